//! What the visibility pass keeps from frame to frame never shows: whatever changes, the picture is the one that
//! lookups of all shadow maps give.

use crate::desk::{Desk, Shot};
use bevy::{light::NotShadowCaster, prelude::*};
use bevy_mirrorball::{headless, lighting::RealLight, prelude::*, probe::UniformSky, shadows::VisibilitySamples};

/// Largest difference that counts as none, of 255: sums of other frames are rounded to 16-bit floats alike.
const ALIKE: u8 = 1;
/// Smallest difference that shows that a change was seen.
const SEEN: u8 = 4;

/// A desk with a box that casts, a board that only receives, and a real light above.
struct Scene {
    desk: Desk,
    block: Entity,
    board: Entity,
    light: Entity,
}

impl Scene {
    fn new(samples: VisibilitySamples) -> Option<Self> {
        let mut desk = Desk::new()?;
        let block = desk.add_virtual(Cuboid::from_length(0.08), Vec3::new(-0.08, 0.04, 0.0));
        let board = desk.add_virtual(Cuboid::new(0.1, 0.01, 0.1), Vec3::new(0.1, 0.005, 0.0));
        desk.app.world_mut().entity_mut(board).insert(NotShadowCaster);
        let light = RealLight {
            id: 1,
            direction: Vec3::new(-0.6, 1.0, 0.2).normalize(),
            position: None,
            color: LinearRgba::WHITE,
            irradiance: 1.0,
            angular_radius: 0.3,
            fraction: 0.3,
        };
        let light = desk.app.world_mut().spawn(light).id();
        let dome = ShadowDomeLight { directions: 16, samples, refreshed_per_frame: 1000, ..default() };
        desk.app.world_mut().entity_mut(desk.dome).insert(dome);
        headless::settle(&mut desk.app).expect("all shaders compile");
        Some(Self { desk, block, board, light })
    }

    fn change<T: Component<Mutability = bevy::ecs::component::Mutable>>(
        &mut self,
        entity: Entity,
        change: impl FnOnce(&mut T),
    ) {
        let mut entity = self.desk.app.world_mut().entity_mut(entity);
        change(&mut entity.get_mut::<T>().expect("the scene has it"));
    }

    /// The picture after all that was kept has been thrown away, as another setting for a frame does.
    fn shoot_anew(&mut self) -> Shot {
        let dome = self.desk.dome;
        for _ in 0..2 {
            self.change(dome, |dome: &mut ShadowDomeLight| dome.occludes_reflections ^= true);
            self.desk.app.update();
        }
        self.desk.shoot()
    }

    /// Asserts that a change shows, and that nothing kept does.
    fn check(&mut self, name: &str, before: &Shot) -> Shot {
        let kept = self.desk.shoot();
        let anew = self.shoot_anew();
        let (changed, off) = (kept.difference(&before.0), kept.difference(&anew.0));
        println!("{name}: changed by {changed}/255, off by {off}/255");
        assert!(changed >= SEEN, "{name} changes the picture by only {changed}/255");
        assert!(off <= ALIKE, "{name}: what was kept is off by {off}/255");
        kept
    }
}

fn nothing_kept_shows(samples: VisibilitySamples) {
    let Some(mut scene) = Scene::new(samples) else { return };
    let (block, board, light, camera) = (scene.block, scene.board, scene.light, scene.desk.camera);
    let mut last = scene.desk.shoot();
    scene.change(board, |place: &mut Transform| place.translation = Vec3::new(-0.13, 0.005, 0.05));
    last = scene.check("a receiver in the shadow", &last);
    scene.change(block, |place: &mut Transform| place.translation.x += 0.05);
    last = scene.check("a caster aside", &last);
    scene.change(light, |light: &mut RealLight| light.direction = Vec3::new(0.6, 1.0, 0.2).normalize());
    last = scene.check("a key light elsewhere", &last);
    scene.change(camera, |place: &mut Transform| place.translation.x += 0.02);
    last = scene.check("a camera aside", &last);
    scene.desk.app.world_mut().despawn(light);
    last = scene.check("a key light gone", &last);
    let probe = scene.desk.probe;
    scene.change(probe, |sky: &mut UniformSky| sky.radiance = Some(Vec3::new(0.1, 0.4, 0.9)));
    scene.check("other light, which virtual things show", &last);
}

#[test]
fn nothing_kept_of_interleaved_samples_shows() {
    nothing_kept_shows(VisibilitySamples::Interleaved);
}

#[test]
fn nothing_kept_of_samples_of_all_directions_shows() {
    nothing_kept_shows(VisibilitySamples::Half);
}
