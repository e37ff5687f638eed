//! Shadows of things that are thin beside a texel, a pixel or the distance to what they are seen against.

use super::{
    key_lights::{LAMP_RAYS, LAMP_TO_SKY, cone, lamp_and_sky},
    rays::{RAYS, Shape, Thing, sky, true_ratio},
    virtual_scene::{VirtualScene, shoot},
};
use crate::desk::{INTRINSICS, SIZE};
use bevy::prelude::*;
use bevy_mirrorball::{camera::srgb_to_linear, prelude::*};

/// The camera is near, so that pixels are fine.
const CAMERA: Vec3 = Vec3::new(0.08, 0.15, 0.02);
const POLE_HEIGHT: f32 = 0.2;
/// Width of the pole and of its shadow in pixels.
const POLE_PIXELS: f32 = 3.0;

fn pixel_width() -> f32 {
    CAMERA.y / INTRINSICS.focal.x
}

/// A pole on the desk, and a ball and a box that make the scene as large as a desk.
fn pole_between_things() -> Vec<Thing> {
    let half_width = 0.5 * POLE_PIXELS * pixel_width();
    let thing = |shape, x, y, z| Thing { shape, center: Vec3::new(x, y, z), is_real: false };
    vec![
        thing(Shape::Block(Vec3::new(half_width, 0.5 * POLE_HEIGHT, half_width)), 0.0, 0.5 * POLE_HEIGHT, 0.0),
        thing(Shape::Ball(0.03), -0.2, 0.03, -0.15),
        thing(Shape::Block(Vec3::splat(0.03)), 0.25, 0.03, -0.15),
    ]
}

/// Index of the green channel of a pixel, and the place on the desk at its middle.
fn pixel_of(place: Vec3) -> (usize, Vec3) {
    let pixel = (INTRINSICS.center + (place - CAMERA).xz() / pixel_width()).floor();
    let on_desk = (pixel + 0.5 - INTRINSICS.center) * pixel_width();
    let index = 4 * (pixel.y as usize * SIZE.x as usize + pixel.x as usize) + 1;
    (index, Vec3::new(CAMERA.x + on_desk.x, 0.0, CAMERA.z + on_desk.y))
}

#[test]
fn a_pole_three_pixels_wide_throws_an_unbroken_shadow_at_desk_and_room_scale() {
    let things = pole_between_things();
    // Neither along pixels nor along texels.
    let towards = Quat::from_rotation_y(0.3) * Vec3::new(-0.6, 0.8, 0.0);
    let shadow = -towards.xz().normalize() * POLE_HEIGHT * towards.xz().length() / towards.y;
    for (radius, scale) in [(0.03, 1.0), (0.03, 20.0), (0.07, 1.0)] {
        let (map, light) = lamp_and_sky(towards, radius);
        let dome = ShadowDomeLight::default();
        let scene = VirtualScene { things: &things, scale, camera: CAMERA, map, map_rotation: Quat::IDENTITY, dome };
        let Some((mut app, picture, open)) = scene.furnish() else { return };
        app.world_mut().spawn(light);
        let shot = shoot(&mut app, &picture);
        let mut rays = sky(|_| Vec3::splat(2.0 / RAYS as f32));
        let strength = Vec3::splat(LAMP_TO_SKY / (LAMP_RAYS as f32 * towards.y));
        rays.extend(cone(towards, radius).map(|dir| (dir, strength)));
        let (mut weakest, mut worst, mut count) = (f32::MAX, 0.0f32, 0);
        for step in 8..92 {
            let place = shadow * (step as f32 / 100.0);
            let (index, place) = pixel_of(Vec3::new(place.x, 0.0, place.y));
            let missing = 1.0 - srgb_to_linear(shot.0[index]) / srgb_to_linear(open.0[index]);
            let expected = 1.0 - true_ratio(&things, &rays, place).y;
            weakest = weakest.min(missing / expected);
            worst = worst.max((missing - expected).abs());
            count += 1;
        }
        println!(
            "lamp of radius {radius}, {scale} times as large: weakest {weakest:.2} of {count} places, worst {worst:.3}"
        );
        assert!(weakest > 0.6, "the shadow has a gap: {weakest}");
    }
}
