//! Bands under a chosen key light: they follow it, and no band is jumped over.

use super::bands::{assert_bands, band_color};
use crate::studio::{SIZE, Studio, normals, toon};
use bevy::prelude::*;
use bevy_mirrorball::{camera::srgb_to_linear, headless, prelude::*};

const DIR: Vec3 = Vec3::new(0.6, 0.64, 0.48);
const DARK: Vec3 = Vec3::new(0.15, 0.15, 0.3);
const BRIGHT: Vec3 = Vec3::new(0.7, 0.6, 0.3);

fn keyed(bands: u32, key: ToonKey) -> SurfaceStyle {
    SurfaceStyle::Toon(ToonStyle { bands, key, highlight: false, outline_width: 0.0, ..default() })
}

fn real_light(id: u32, direction: Vec3, irradiance: f32) -> RealLight {
    RealLight {
        id,
        direction: direction.normalize(),
        position: None,
        color: LinearRgba::WHITE,
        irradiance,
        angular_radius: 0.05,
        fraction: 0.2,
    }
}

/// Light of the room on white paper.
fn light_on(normal: Vec3) -> Vec3 {
    DARK.lerp(BRIGHT, 0.5 + 0.5 * normal.dot(DIR))
}

/// Asserts that the ball has the bands of N·L for a light, to less than 5°: `assert_bands` tolerates a sixth of a band.
fn assert_follows(studio: &mut Studio, bands: u32, dir: Vec3) {
    let picture = studio.shoot();
    assert_bands(&picture, bands, light_on(-dir), light_on(dir), |normal| normal.dot(dir).max(0.0));
}

#[test]
fn bands_follow_the_direction_of_the_author() {
    let dir = Vec3::new(-0.3, 0.5, 0.8).normalize();
    let Some(mut studio) = Studio::new(keyed(3, ToonKey::Direction(7.0 * dir))) else { return };
    studio.add_sky(DIR, DARK, BRIGHT);
    assert_follows(&mut studio, 3, dir);
    studio.set_style(keyed(4, ToonKey::Direction(DIR)));
    assert_follows(&mut studio, 4, DIR);
    studio.set_style(toon(3));
    let prevailing = studio.shoot();
    for unknown in [Vec3::ZERO, Vec3::NAN, Vec3::splat(f32::INFINITY)] {
        studio.set_style(keyed(3, ToonKey::Direction(unknown)));
        assert_eq!(studio.shoot().difference(&prevailing), 0, "{unknown}");
    }
}

#[test]
fn bands_follow_the_strongest_real_light_as_it_turns() {
    let Some(mut studio) = Studio::new(keyed(3, ToonKey::StrongestRealLight)) else { return };
    studio.add_sky(DIR, DARK, BRIGHT);
    let without = studio.shoot();
    studio.set_style(toon(3));
    assert_eq!(studio.shoot().difference(&without), 0, "without a real light the prevailing one counts");
    studio.set_style(keyed(3, ToonKey::StrongestRealLight));
    let dir = |step: u32| Quat::from_rotation_y(5_f32.to_radians() * step as f32) * Vec3::new(-0.5, 0.4, 0.7);
    let light = studio.app.world_mut().spawn(real_light(1, dir(0), 2.0)).id();
    studio.app.world_mut().spawn(real_light(2, Vec3::NEG_Y, 1.0));
    for _ in 0..4 {
        studio.shoot();
    }
    for step in 0..5 {
        studio.app.world_mut().entity_mut(light).insert(real_light(1, dir(step), 2.0));
        assert_follows(&mut studio, 3, dir(step).normalize());
    }
}

#[test]
fn bands_follow_a_room_that_turns() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    for step in 0..4 {
        let dir = Quat::from_rotation_z(-5_f32.to_radians() * step as f32) * DIR;
        studio.add_sky(dir, DARK, BRIGHT);
        assert_bands(&studio.shoot(), 3, DARK, BRIGHT, |normal| 0.5 + 0.5 * normal.dot(dir));
    }
}

#[test]
fn no_band_is_jumped_over_when_lights_appear_change_places_and_vanish() {
    const BANDS: u32 = 5;
    const SKY: f32 = 0.8;
    const APPEARS: u32 = 2;
    const TAKES_OVER: u32 = 20;
    const VANISH: u32 = 50;
    const FRAMES: u32 = 66;
    let Some(mut studio) = Studio::new(keyed(BANDS, ToonKey::StrongestRealLight)) else { return };
    studio.add_sky(Vec3::Y, Vec3::splat(SKY), Vec3::splat(SKY));
    // Without a prevailing direction, everything is in the highest band.
    let place = |band: u32| (band as f32 + 0.5) / BANDS as f32;
    let colors: Vec<f32> = (0..BANDS)
        .map(|band| band_color(place(band), BANDS, Vec3::splat(SKY), Vec3::splat(SKY)).expect("in its middle").x)
        .collect();
    studio.shoot();
    let world = studio.app.world_mut();
    let mut lights = [1, 2].map(|_| world.spawn_empty().id()).to_vec();
    let [first, second] = [lights[0], lights[1]];
    // What happens before which frame.
    let change = |app: &mut App, frame: u32| match frame {
        APPEARS => drop(app.world_mut().entity_mut(first).insert(real_light(1, Vec3::new(0.9, 0.1, 0.3), 1.0))),
        TAKES_OVER => drop(app.world_mut().entity_mut(second).insert(real_light(2, Vec3::new(-0.8, 0.5, 0.2), 3.0))),
        VANISH => lights.drain(..).for_each(|light| assert!(app.world_mut().despawn(light))),
        _ => (),
    };
    let mut frames: Vec<Vec<usize>> = Vec::new();
    let (app, picture) = (&mut studio.app, studio.picture.clone());
    headless::record(app, &picture, FRAMES, change, |_, bytes| frames.push(bands_of(&bytes, &colors)))
        .expect("frames come back");
    let jumps: Vec<usize> = frames
        .windows(2)
        .map(|pair| pair[0].iter().zip(&pair[1]).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or_default())
        .collect();
    println!("largest jumps from frame to frame: {jumps:?}");
    let highest = |frame: u32| frames[frame as usize].iter().all(|band| *band == BANDS as usize - 1);
    assert!(highest(0) && highest(FRAMES - 1) && !highest(TAKES_OVER), "the light appears and vanishes");
    assert!(frames[TAKES_OVER as usize] != frames[VANISH as usize], "it changes its place");
    assert!(jumps.iter().all(|jump| *jump <= 1));
}

/// Nearest band of each pixel of the ball.
fn bands_of(bytes: &[u8], colors: &[f32]) -> Vec<usize> {
    let nearest = |pixel: UVec2| {
        let gray = srgb_to_linear(bytes[4 * (pixel.y * SIZE.x + pixel.x) as usize]);
        let distances = colors.iter().map(|color| (color - gray).abs());
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(band, _)| band)
    };
    normals().map(|(pixel, _)| nearest(pixel)).collect()
}
