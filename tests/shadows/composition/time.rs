//! Effects that mix frames or follow motion. The photograph does not move when the virtual camera does: in a real frame
//! both have moved, and the frame has the motion blur of the real camera already.

use super::{Picture, SEEN, Scene, UNCHANGED};
use crate::desk::HEIGHT;
use bevy::prelude::*;
use bevy_anti_alias::taa::TemporalAntiAliasing;
use bevy_mirrorball::headless;
use bevy_post_process::motion_blur::MotionBlur;

/// As `ALIKE`, beside the box under temporal antialiasing: within two pixels of a nearer surface Bevy takes that
/// surface's motion, so the steep shadow there is averaged over samples that move within pixels.
const JITTERED: u8 = 6;

/// The camera above the desk at a step of a shaky hand.
fn shaky(step: u32) -> Transform {
    let shift = Vec3::new(0.02, 0.0, -0.015) * if step.is_multiple_of(2) { 1.0 } else { -1.0 };
    let eye = Vec3::new(0.0, HEIGHT, 0.0) + shift;
    // Turned by a few degrees too, which moves what is infinitely far away.
    Transform::from_translation(eye).looking_at(-2.0 * shift, Vec3::NEG_Z)
}

impl Scene {
    /// A picture while the camera shakes.
    fn shoot_shaking(&mut self) -> Picture {
        headless::settle(&mut self.desk.app).expect("all shaders compile");
        for step in 0..20 {
            self.desk.app.world_mut().entity_mut(self.desk.camera).insert(shaky(step));
            if step < 19 {
                self.desk.app.update();
            }
        }
        let picture = headless::read_texture(&mut self.desk.app, &self.desk.picture);
        Picture(picture.expect("the picture comes back"))
    }

    /// A picture from where the camera is last when it shakes, at rest.
    fn shoot_at_rest(&mut self) -> Picture {
        self.desk.app.world_mut().entity_mut(self.desk.camera).insert(shaky(19));
        self.shoot()
    }
}

#[test]
fn temporal_antialiasing_keeps_the_photograph_at_rest_and_in_motion() {
    let Some(mut scene) = Scene::with_box() else { return };
    let (plain, at_rest) = (scene.shoot(), scene.shoot_at_rest());
    scene.on_camera((
        TemporalAntiAliasing::default(),
        Transform::from_xyz(0.0, HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
    ));
    // Every place within a pixel that the engine samples in turn, of which one is its middle.
    for _ in 0..8 {
        let shown = scene.shoot();
        scene.check_within(JITTERED, "taa", &shown, &plain);
        scene.desk.app.update();
    }
    let shaking = scene.shoot_shaking();
    shaking.save("taa_shaking");
    let behind = scene.behind(&shaking, &at_rest);
    println!("TAA of a shaking camera: {behind}/255");
    assert!(behind <= UNCHANGED, "the camera's picture is smeared by {behind}/255");
}

#[test]
fn motion_blur_blurs_virtual_things_and_not_the_photograph() {
    let Some(mut scene) = Scene::with_box() else { return };
    let at_rest = scene.shoot_at_rest();
    scene.on_camera(MotionBlur { shutter_angle: 1.0, samples: 4 });
    let shaking = scene.shoot_shaking();
    shaking.save("motion_blur");
    let behind = scene.behind(&shaking, &at_rest);
    println!("motion blur of a shaking camera: {behind}/255 behind, {} at most", shaking.difference(&at_rest));
    assert!(behind <= UNCHANGED, "the camera's picture is smeared by {behind}/255");
    assert!(shaking.difference(&at_rest) >= SEEN, "the box is not blurred");
}
