//! Key lights: distant, near, and from a lights file.

use super::rays::{CUBE_EDGE, RAYS, compare, furnished_desk, places, set_dome, sky, things, true_ratio, truth};
use crate::sky_cube::sky_cube;
use bevy::prelude::*;
use bevy_mirrorball::{
    environment_map::EnvironmentCube,
    lighting::RealLight,
    prelude::*,
    shadows::{DomeCoverage, DomeLights, DomeState, LightsFile, VisibilitySamples},
};

/// Of the lamp's light to that of the sky around it, on the desk.
pub(super) const LAMP_TO_SKY: f32 = 2.0;
const LAMP_RADIUS: f32 = 0.07;
/// Directions of the reference within the lamp.
pub(super) const LAMP_RAYS: u32 = 1024;

/// Evenly spread directions within an angle around one.
pub(super) fn cone(around: Vec3, radius: f32) -> impl Iterator<Item = Vec3> {
    let (right, up) = around.any_orthonormal_pair();
    (0..LAMP_RAYS).map(move |i| {
        let (sin, cos) = (i as f32 * 0.618_034 * std::f32::consts::TAU).sin_cos();
        let across = radius.tan() * ((i as f32 + 0.5) / LAMP_RAYS as f32).sqrt();
        (around + across * (cos * right + sin * up)).normalize()
    })
}

/// A lamp of an angular radius among a dim sky, as a cube and as the light that is found in it.
pub(super) fn lamp_and_sky(towards: Vec3, angular_radius: f32) -> (Image, RealLight) {
    let solid_angle = std::f32::consts::TAU * (1.0 - angular_radius.cos());
    let radiance = LAMP_TO_SKY * std::f32::consts::PI / (solid_angle * towards.y);
    let image = sky_cube(CUBE_EDGE, |dir| {
        Vec3::splat(0.1 + if dir.angle_between(towards) < angular_radius { 0.1 * radiance } else { 0.0 })
    });
    let light = RealLight {
        id: 1,
        direction: towards,
        position: None,
        color: LinearRgba::WHITE,
        irradiance: 0.1 * radiance * solid_angle,
        angular_radius,
        fraction: 0.5,
    };
    (image, light)
}

#[test]
fn a_key_light_throws_its_shadow_where_rays_throw_it() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    let towards = Vec3::new(-0.1, 0.8, 0.4).normalize();
    let (image, light) = lamp_and_sky(towards, LAMP_RADIUS);
    let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(image);
    desk.app.world_mut().spawn(EnvironmentCube(image));
    desk.app.world_mut().spawn(light);
    // Of all rays together the sky gives the desk 1, so to speak, and the lamp twice as much.
    let mut rays = sky(|_| Vec3::splat(2.0 / RAYS as f32));
    rays.extend(cone(towards, LAMP_RADIUS).map(|dir| (dir, Vec3::splat(LAMP_TO_SKY / (LAMP_RAYS as f32 * towards.y)))));
    let truth = truth(&things(), &rays);
    let mut errors = |key_lights: u32| {
        set_dome(&mut desk, ShadowDomeLight { key_lights, samples: VisibilitySamples::Full, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!(
            "{key_lights} key lights: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
            errors.rms, errors.rms_in_shadow, errors.worst
        );
        let state = desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
        assert_eq!(state.key_lights, key_lights.min(1));
        errors.rms
    };
    let (without, with) = (errors(0), errors(2));
    assert!(with <= 0.02 && with < 0.3 * without);
    // The sum of all light stays what it is: where nothing is in the way the picture is untouched.
    let shot = desk.shoot();
    let far = Vec3::new(-0.3, 0.0, -0.2);
    assert!((shot.ratio(far) - 1.0).abs() < 0.02, "{}", shot.ratio(far));
}

#[test]
fn a_near_key_light_throws_shadows_from_where_it_is() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    let ball = Vec3::new(0.0, 0.05, 0.0);
    let position = Vec3::new(0.35, 0.55, 0.2);
    let (towards, away) = (position - ball).normalize_and_length();
    let (image, light) = lamp_and_sky(towards, LAMP_RADIUS);
    let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(image);
    // The cube's place is where the light was measured.
    desk.app.world_mut().spawn((EnvironmentCube(image), Transform::from_translation(ball)));
    desk.app.world_mut().spawn(RealLight { position: Some(position), ..light });
    let lamp_radius = away * LAMP_RADIUS.tan();
    let truth: Vec<_> = places(&things())
        .into_iter()
        .map(|place| {
            let mut rays = sky(|_| Vec3::splat(2.0 / RAYS as f32));
            let (dir, distance) = (position - place).normalize_and_length();
            let strength = LAMP_TO_SKY / (LAMP_RAYS as f32 * towards.y) * (away / distance).powi(2);
            rays.extend(cone(dir, (lamp_radius / distance).atan()).map(|dir| (dir, Vec3::splat(strength))));
            (place, true_ratio(&things(), &rays, place))
        })
        .collect();
    let mut errors = |key_lights: u32| {
        set_dome(&mut desk, ShadowDomeLight { key_lights, samples: VisibilitySamples::Full, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!("near lamp, {key_lights} key lights: RMSE {:.4}, worst {:.3}", errors.rms, errors.worst);
        errors.rms
    };
    let (without, with) = (errors(0), errors(2));
    assert!(with <= 0.02 && with < 0.3 * without);
}

#[test]
fn lights_of_a_file_throw_shadows_from_where_they_are() {
    let Some(mut desk) = furnished_desk() else { return };
    let spot = Vec3::new(-0.25, 0.5, -0.2);
    let text = format!(
        r#"(lights: [
            (id: "spot", kind: Spot, position: ({}, {}, {}), look_at: (0.0, 0.0, 0.0), field_of_view: 80.0, far: 2.0),
            (id: "window", kind: Directional, position: (1.0, 1.5, 0.0), look_at: (0.0, 0.0, 0.0)),
        ])"#,
        spot.x, spot.y, spot.z
    );
    let window = Vec3::new(1.0, 1.5, 0.0).normalize();
    let file = LightsFile::parse(&text).expect("valid");
    let file = desk.app.world_mut().resource_mut::<Assets<LightsFile>>().add(file);
    let samples = VisibilitySamples::Full;
    let dome = ShadowDomeLight { samples, coverage: DomeCoverage::Sphere, ..default() };
    desk.app.world_mut().entity_mut(desk.dome).insert((dome, DomeLights(file)));
    // Each has the half of the sphere that is nearer to it: under an even sky the same light.
    let truth: Vec<_> = places(&things())
        .into_iter()
        .map(|place| {
            let rays = [((spot - place).normalize(), Vec3::ONE), (window, Vec3::ONE)];
            (place, true_ratio(&things(), &rays, place))
        })
        .collect();
    let shaded = truth.iter().filter(|(_, ratio)| ratio.y < 0.9).count();
    assert!(shaded > 100, "{shaded}");
    let shot = desk.shoot();
    let state = desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
    println!("{state:?}");
    // At the edges of hard shadows a pixel is here or there.
    let wrong = truth.iter().filter(|(place, expected)| (shot.ratio(*place) - expected.y).abs() > 0.05).count();
    println!("{wrong} of {} places are off", truth.len());
    assert!(wrong * 50 < truth.len());
}
