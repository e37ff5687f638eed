//! Virtual lamps on the frame of a real desk under a uniform sky, against photometry.

use crate::desk::{Desk, HEIGHT, INTRINSICS, SIZE, SKY, Shot};
use bevy::{
    camera::Exposure,
    light::{CascadeShadowConfig, CascadeShadowConfigBuilder},
    prelude::*,
};
use bevy_mirrorball::{camera::srgb_to_linear, prelude::*};
use std::f32::consts::PI;

/// Rounding to 8 bits.
const SAME: u8 = 1;
/// Of the factor on the picture; the mean over pixels of many brightnesses has less rounding than one.
const FACTOR_TOLERANCE: f32 = 0.01;
/// Shadow maps have texels, and the dome's share of the shadow is in the picture with and without the lamp.
const SHADOW_TOLERANCE: f32 = 0.02;

/// Dark enough that twice the light is not clipped, in enough shades that rounding averages out.
fn desk_picture() -> Vec<u8> {
    (0..SIZE.x * SIZE.y).flat_map(|i| [120 + (7 * i % 31) as u8, 110 + (5 * i % 29) as u8, 128, 255]).collect()
}

fn measured_desk() -> Option<Desk> {
    Desk::in_measured_room(desk_picture())
}

/// Factor on the camera's linear red and green in 5 × 5 pixels around a place on the desk.
fn factor(shot: &Shot, place: Vec2) -> f32 {
    let pixel = (INTRINSICS.center + INTRINSICS.focal * place / HEIGHT).as_ivec2();
    let (mut after, mut before) = (0.0, 0.0);
    for (x, y) in (-2..=2).flat_map(|y| (-2..=2).map(move |x| (pixel.x + x, pixel.y + y))) {
        let at = 4 * (y * SIZE.x as i32 + x) as usize;
        for channel in at..at + 2 {
            after += srgb_to_linear(shot.0[channel]);
            before += srgb_to_linear(desk_picture()[channel]);
        }
    }
    after / before
}

/// Irradiance ÷ irradiance in the room, of a lamp in Bevy's units.
fn gain(irradiance: f32) -> f32 {
    irradiance * Exposure::default().exposure() / (PI * SKY)
}

/// Lux of a lamp that falls straight on the desk and adds as much as the room gives.
fn as_bright_as_the_room() -> f32 {
    1.0 / gain(1.0)
}

fn directional(elevation: f32, illuminance: f32, shadow_maps_enabled: bool) -> impl Bundle {
    let from = Vec3::new(elevation.cos(), elevation.sin(), 0.0);
    let cascades: CascadeShadowConfig =
        CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 1.0, ..default() }.into();
    let lamp = DirectionalLight { illuminance, shadow_maps_enabled, ..default() };
    (lamp, cascades, Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::Y))
}

#[test]
fn a_directional_lamp_adds_its_illuminance_times_the_cosine() {
    let Some(mut desk) = measured_desk() else { return };
    let without = desk.shoot().difference(&desk_picture());
    println!("no lamp: off by {without}/255");
    assert!(without <= SAME);
    for (elevation, share) in [(PI / 2.0, 0.6), (PI / 4.0, 0.9), (0.4, 1.2)] {
        let illuminance = share * as_bright_as_the_room();
        let lamp = desk.app.world_mut().spawn(directional(elevation, illuminance, false)).id();
        let expected = 1.0 + gain(illuminance) * elevation.sin();
        let shot = desk.shoot();
        for place in [Vec2::ZERO, Vec2::new(0.25, -0.15), Vec2::new(-0.25, 0.15)] {
            let factor = factor(&shot, place);
            println!("from {elevation:.2} rad above the desk at {place}: {factor:.4}, expected {expected:.4}");
            assert!((factor / expected - 1.0).abs() <= FACTOR_TOLERANCE);
        }
        desk.app.world_mut().despawn(lamp);
    }
    let gone = desk.shoot().difference(&desk_picture());
    assert!(gone <= SAME, "lamps gone: off by {gone}");
}

#[test]
fn point_and_spot_lamps_fall_off_with_the_square_of_the_distance() {
    const LAMP_HEIGHT: f32 = 0.3;
    let Some(mut desk) = measured_desk() else { return };
    // Lumens in all directions that give straight below what the room gives.
    let intensity = 4.0 * PI * LAMP_HEIGHT * LAMP_HEIGHT * as_bright_as_the_room();
    let at_lamp = Transform::from_xyz(0.0, LAMP_HEIGHT, 0.0);
    let point = desk.app.world_mut().spawn((PointLight { intensity, ..default() }, at_lamp)).id();
    let expected = |x: f32| 1.0 + (1.0 + (x / LAMP_HEIGHT).powi(2)).powf(-1.5);
    let check = |shot: &Shot, name: &str| {
        for x in [0.0, 0.1, 0.2, 0.3] {
            let factor = factor(shot, Vec2::new(x, 0.0));
            println!("{name} at {x} m: {factor:.4}, expected {:.4}", expected(x));
            // The mean over pixels is a little below the peak.
            assert!((factor / expected(x) - 1.0).abs() <= FACTOR_TOLERANCE);
        }
    };
    check(&desk.shoot(), "point lamp");
    desk.app.world_mut().despawn(point);
    // All of the right side is within its inner cone, the left edge outside of its outer one.
    let aim = Transform::from_xyz(0.0, LAMP_HEIGHT, 0.0).looking_at(Vec3::new(0.16, 0.0, 0.0), Vec3::Z);
    let lamp = SpotLight { intensity, inner_angle: 0.55, outer_angle: 0.6, ..default() };
    desk.app.world_mut().spawn((lamp, aim));
    let shot = desk.shoot();
    check(&shot, "spot lamp");
    let beside = factor(&shot, Vec2::new(-0.2, 0.0));
    println!("outside of the cone: {beside:.4}");
    assert!((beside - 1.0).abs() <= FACTOR_TOLERANCE);
}

#[test]
fn spot_lamps_of_short_range_light_the_desk() {
    let Some(mut desk) = measured_desk() else { return };
    let intensity = 4.0 * PI * 0.09 * as_bright_as_the_room();
    let aim = Transform::from_xyz(0.0, 0.3, 0.0).looking_at(Vec3::ZERO, Vec3::Z);
    let lamp = SpotLight { intensity, range: 1.0, inner_angle: 0.3, outer_angle: 0.4, ..default() };
    desk.app.world_mut().spawn((lamp, aim));
    let factor = factor(&desk.shoot(), Vec2::ZERO);
    println!("a lamp with a range of 1 m: {factor:.4}");
    // Bevy's lamps fade out towards their range.
    assert!((1.95..=2.01).contains(&factor));
}

#[test]
fn virtual_and_real_boxes_throw_shadows_of_lamps_on_the_desk() {
    let (shadowed, open) = (Vec2::new(-0.07, 0.0), Vec2::new(0.2, 0.1));
    for is_real in [false, true] {
        let Some(mut desk) = measured_desk() else { return };
        let block = Cuboid::new(0.04, 0.1, 0.12);
        let place = Vec3::new(0.0, 0.05, 0.0);
        if is_real {
            desk.add(block, place, PhantomObject::default());
        } else {
            let paint = desk.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(Color::srgb(0.8, 0.4, 0.2));
            desk.add(block, place, MeshMaterial3d(paint));
        }
        let before = desk.shoot();
        desk.app.world_mut().spawn(directional(PI / 4.0, 1.2 * as_bright_as_the_room(), true));
        let after = desk.shoot();
        let kind = if is_real { "real" } else { "virtual" };
        let added = |place| factor(&after, place) - factor(&before, place);
        let expected = 1.2 * (PI / 4.0).sin();
        println!(
            "{kind} box: lamp adds {:.3} in its shadow, {:.3} outside ({expected:.3})",
            added(shadowed),
            added(open)
        );
        assert!(added(shadowed).abs() <= SHADOW_TOLERANCE);
        assert!((added(open) - expected).abs() <= SHADOW_TOLERANCE);
        let own = factor(&before, shadowed);
        assert!(if is_real { (own - 1.0).abs() <= SHADOW_TOLERANCE } else { own < 0.9 }, "without lamp: {own}");
    }
}

#[test]
fn where_the_room_is_not_known_lamps_leave_the_picture_alone() {
    let Some(mut desk) = Desk::in_unknown_room(desk_picture()) else { return };
    // Else a sky would be assumed.
    desk.forget_fallback();
    desk.app.world_mut().spawn(directional(PI / 4.0, 2.0 * as_bright_as_the_room(), true));
    let off = desk.shoot().difference(&desk_picture());
    println!("no environment map: off by {off}/255");
    assert!(off <= SAME);
    // A ball out of view has an environment, but without a fallback a black one.
    desk.app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 5.0, 0.0)));
    let off = desk.shoot().difference(&desk_picture());
    println!("nothing measured: off by {off}/255");
    assert!(off <= SAME);
}
