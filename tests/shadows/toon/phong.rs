//! Kunze's formula with his kind of ramps, against a twin on the CPU.

use super::ramps::ramps_of;
use crate::studio::{Studio, normals};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Rounding to 8 bits, of the picture and of the ramps.
const TOLERANCE: f32 = 0.012;
/// Distance from the edge of a step, in steps, within which pixels are not compared: edges are smoothed over a pixel,
/// at most so far.
const EDGE: f32 = 0.22;
const BASE: Vec3 = Vec3::new(0.8, 0.6, 0.4);

/// Step of a ramp, or `None` near an edge of one that differs from its neighbor.
fn step(ramp: &[u8], x: f32) -> Option<f32> {
    let place = (x * ramp.len() as f32).clamp(0.0, ramp.len() as f32 - 0.001);
    let at = |place: f32| ramp[(place.max(0.0) as usize).min(ramp.len() - 1)];
    (at(place - EDGE) == at(place + EDGE)).then(|| f32::from(at(place)) / 255.0)
}

/// Kunze 2006: `K_d · ramp_d(N·L) + K_s · ramp_s((R·V)ⁿ)`, the highlight 0 where N·L is.
fn kunze(phong: PhongToon, diffuse: &[u8], specular: &[u8], normal: Vec3, light: Vec3) -> Option<Vec3> {
    let cosine = normal.dot(light);
    let mirrored = 2.0 * cosine * normal - light;
    let lobe = mirrored.dot(Vec3::Z).max(0.0).powf(phong.exponent);
    let matte = BASE * phong.diffuse * step(diffuse, cosine.max(0.0))?;
    let is_at_terminator = cosine.abs() < 0.02;
    let highlight = if cosine > 0.0 { step(specular, lobe)? } else { 0.0 };
    (!is_at_terminator).then(|| (matte + phong.specular * highlight).clamp(Vec3::ZERO, Vec3::ONE))
}

/// Two to five levels; steps of unequal width are repeated pixels.
const DIFFUSE: [&[u8]; 5] =
    [&[60, 220], &[40, 130, 255], &[0, 90, 90, 90, 200, 255, 255, 255], &[30, 80, 150, 250], &[20, 60, 120, 180, 240]];
/// The first step is 0 where there is no highlight; the last has several steps of it.
const SPECULAR: [&[u8]; 3] = [&[0, 255], &[0, 0, 0, 255], &[0, 0, 100, 100, 180, 255, 255, 255]];

#[test]
fn kunzes_formula_is_exact_with_any_ramps() {
    let phong = PhongToon { diffuse: 0.7, specular: 0.4, exponent: 8.0 };
    let light = Vec3::new(0.4, 0.5, 0.6).normalize();
    let style = |phong, key| {
        let model = ToonModel::Phong(phong);
        SurfaceStyle::Toon(ToonStyle { model, key, outline_width: 0.0, ..default() })
    };
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.set_ball(Color::linear_rgb(BASE.x, BASE.y, BASE.z), style(phong, ToonKey::Direction(light)));
    let check = |studio: &mut Studio, phong: PhongToon, diffuse: &[u8], specular: &[u8], light: Vec3| {
        let ramps = ramps_of(studio, Some(diffuse), Some(specular));
        studio.app.world_mut().entity_mut(studio.ball).insert(ramps);
        let picture = studio.shoot();
        let (mut worst, mut compared) = (0.0_f32, 0);
        for (pixel, normal) in normals() {
            if let Some(expected) = kunze(phong, diffuse, specular, normal, light) {
                worst = worst.max((picture.linear(pixel) - expected).abs().max_element());
                compared += 1;
            }
        }
        println!("{diffuse:?} and {specular:?}: off by {worst:.4} in {compared} pixels");
        assert!(worst <= TOLERANCE && compared > normals().count() / 3);
    };
    for (diffuse, specular) in DIFFUSE.into_iter().zip(SPECULAR.into_iter().cycle()) {
        check(&mut studio, phong, diffuse, specular, light);
    }
    // From behind, where the highlight's lobe is not 0 everywhere.
    let low = Vec3::new(0.9, 0.1, -0.3).normalize();
    let wide = PhongToon { exponent: 1.0, ..phong };
    studio.set_style(style(wide, ToonKey::Direction(low)));
    check(&mut studio, wide, DIFFUSE[2], SPECULAR[2], low);
    // Under a lamp, the direction is that of the light that prevails, however strong it is.
    studio.add_lamp(light, 0.3);
    studio.set_style(style(phong, ToonKey::Prevailing));
    check(&mut studio, phong, DIFFUSE[1], SPECULAR[2], light);
}

#[test]
fn without_ramps_the_formula_has_bands_and_one_highlight() {
    let model = ToonModel::Phong(PhongToon { diffuse: 1.0, specular: 0.0, exponent: 20.0 });
    let key = ToonKey::Direction(Vec3::Z);
    let style = ToonStyle { model, key, outline_width: 0.0, ..default() };
    let Some(mut studio) = Studio::new(SurfaceStyle::Toon(style)) else { return };
    let picture = studio.shoot();
    // Three bands between 1/6 and 1, equally spaced in lightness.
    let lowest = (1.0_f32 / 6.0).cbrt();
    for (pixel, normal) in normals() {
        let place = 3.0 * normal.z;
        if (place - place.round()).abs() > 0.1 {
            let lightness: f32 = lowest + (1.0 - lowest) * place.floor().min(2.0) / 2.0;
            let found = picture.linear(pixel).x;
            assert!((found - lightness.powi(3)).abs() < TOLERANCE, "{found} at {normal}");
        }
    }
    let shiny = ToonModel::Phong(PhongToon { diffuse: 0.0, specular: 0.9, exponent: 20.0 });
    studio.set_style(SurfaceStyle::Toon(ToonStyle { model: shiny, ..style }));
    let picture = studio.shoot();
    for (pixel, normal) in normals() {
        let lobe = (2.0 * normal.z * normal.z - 1.0).max(0.0).powf(20.0);
        if (lobe - 0.5).abs() > 0.2 {
            let expected = if lobe > 0.5 { 0.9 } else { 0.0 };
            assert!((picture.linear(pixel).x - expected).abs() < TOLERANCE, "{normal}");
        }
    }
}
