//! Mirrors reflect what is beside them, nothing else changes, and nothing is drawn while nothing does.

use crate::{
    desk::{Desk, Shot, desk_picture},
    drawing,
};
use bevy::prelude::*;
use bevy_mirrorball::{
    headless,
    materials::{NeighborReflections, NoNeighborReflections},
};

const RADIUS: f32 = 0.06;
/// Where a ball mirrors what is to its right for a camera above it.
const TO_THE_RIGHT: Vec3 = Vec3::new(0.707 * RADIUS, 1.707 * RADIUS, 0.0);
/// Matte ball in a corner of the mirror's bounds.
const CORNER: Vec3 = Vec3::new(0.055, 0.11, 0.055);

/// A polished ball on the desk, with a red box to its right.
struct Scene {
    desk: Desk,
    mirror: Entity,
    red_box: Entity,
}

impl Scene {
    fn new(max_probes: u32) -> Option<Self> {
        let settings = NeighborReflections { max_probes, faces_per_frame: 6, edge: 32 };
        let app = drawing::app_with(|app| {
            app.insert_resource(settings);
        })?;
        let mut desk = Desk::in_game(app, desk_picture())?;
        let mut materials = desk.app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        let silver = StandardMaterial { metallic: 1.0, perceptual_roughness: 0.1, ..Color::WHITE.into() };
        let silver = MeshMaterial3d(materials.add(silver));
        // Not unlit: in branches that no pixel takes, Bevy's lighting can crash SwiftShader.
        let red = StandardMaterial {
            emissive: LinearRgba::RED,
            emissive_exposure_weight: 0.0,
            reflectance: 0.0,
            ..Color::BLACK.into()
        };
        let red = MeshMaterial3d(materials.add(red));
        let matte = StandardMaterial { reflectance: 0.0, perceptual_roughness: 1.0, ..Color::WHITE.into() };
        let matte = MeshMaterial3d(materials.add(matte));
        let ball = |radius| Sphere::new(radius).mesh().ico(12).expect("few enough");
        let mirror = desk.add(ball(RADIUS), Vec3::new(0.0, RADIUS, 0.0), silver);
        let red_box = desk.add(Cuboid::new(0.06, 0.2, 0.3), Vec3::new(0.15, 0.1, 0.0), red);
        desk.add(ball(0.012), CORNER, matte);
        Some(Self { desk, mirror, red_box })
    }

    /// Faces drawn in twenty frames in which nothing changes, after those in which the last readback is forgotten: it
    /// pauses the camera, and with it the dome's visibility pass. The box is put where it is in every frame.
    fn faces_without_changes(&mut self) -> usize {
        for _ in 0..8 {
            self.desk.app.update();
        }
        (0..20)
            .map(|_| {
                let mut place = self.desk.app.world_mut().get_mut::<Transform>(self.red_box).expect("it is somewhere");
                place.set_changed();
                self.faces_in_next_frame()
            })
            .sum()
    }

    fn shoot(&mut self) -> Shot {
        headless::settle(&mut self.desk.app).expect("all shaders compile");
        self.desk.shoot()
    }

    fn faces_in_next_frame(&mut self) -> usize {
        self.desk.app.update();
        let mut cameras = self.desk.app.world_mut().query::<(&Camera, &Name)>();
        let faces = cameras.iter(self.desk.app.world()).filter(|(_, name)| name.as_str() == "scene probe face");
        faces.filter(|(camera, _)| camera.is_active).count()
    }
}

/// Red and green at a place.
fn red_green(shot: &Shot, place: Vec3) -> [i32; 2] {
    let at = shot.at(place);
    [shot.0[at], shot.0[at + 1]].map(i32::from)
}

fn is_red([red, green]: [i32; 2]) -> bool {
    red > 2 * green
}

#[test]
fn a_polished_ball_mirrors_the_box_beside_it_where_that_is() {
    let (Some(mut with), Some(mut without)) = (Scene::new(4), Scene::new(0)) else { return };
    let (near, room) = (with.shoot(), without.shoot());
    let right = [&near, &room].map(|shot| red_green(shot, TO_THE_RIGHT));
    let left = [&near, &room].map(|shot| red_green(shot, TO_THE_RIGHT * Vec3::new(-1.0, 1.0, 1.0)));
    println!("right {right:?}, left {left:?}");
    assert!(is_red(right[0]) && !is_red(right[1]), "the box is seen");
    assert!(!is_red(left[0]) && !is_red(left[1]), "and only where it is");
    let matte = [&near, &room].map(|shot| red_green(shot, CORNER));
    assert_eq!(matte[0], matte[1], "matte things look as before, also within the bounds of the mirror");
    let beside = Vec3::new(-0.3, 0.0, 0.2);
    assert_eq!(red_green(&near, beside), red_green(&room, beside));
}

#[test]
fn one_that_refuses_shows_the_room() {
    let Some(mut scene) = Scene::new(4) else { return };
    scene.desk.app.world_mut().entity_mut(scene.mirror).insert(NoNeighborReflections);
    assert!(!is_red(red_green(&scene.shoot(), TO_THE_RIGHT)));
    scene.desk.app.world_mut().entity_mut(scene.mirror).remove::<NoNeighborReflections>();
    assert!(is_red(red_green(&scene.shoot(), TO_THE_RIGHT)));
}

#[test]
fn nothing_is_drawn_while_nothing_changes_and_what_moves_is_followed() {
    let Some(mut scene) = Scene::new(4) else { return };
    assert!(is_red(red_green(&scene.shoot(), TO_THE_RIGHT)));
    assert_eq!(scene.faces_without_changes(), 0);
    let mut place = scene.desk.app.world_mut().get_mut::<Transform>(scene.red_box).expect("it is somewhere");
    place.translation.x *= -1.0;
    let drawn: usize = (0..20).map(|_| scene.faces_in_next_frame()).sum();
    println!("{drawn} faces after a movement");
    assert!(drawn >= 6);
    let shot = scene.shoot();
    assert!(!is_red(red_green(&shot, TO_THE_RIGHT)));
    assert!(is_red(red_green(&shot, TO_THE_RIGHT * Vec3::new(-1.0, 1.0, 1.0))));
    assert_eq!(scene.faces_without_changes(), 0);
}
