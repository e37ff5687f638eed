//! A room whose maps are known in closed form, and the models as the documentation has them.

use crate::studio::{Picture, Studio, normals};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use std::f32::consts::PI;

/// Where the light of the room prevails.
const DIR: Vec3 = Vec3::new(0.6, 0.64, 0.48);
const DARK: Vec3 = Vec3::new(0.15, 0.15, 0.3);
const BRIGHT: Vec3 = Vec3::new(0.7, 0.6, 0.3);

/// Towards the camera of the studio, which is orthographic.
pub(super) const VIEW: Vec3 = Vec3::Z;
pub(super) const BASE: Vec3 = Vec3::new(0.8, 0.6, 0.4);

/// Rounding to 8 bits, half floats of the filtered maps and their texels.
const TOLERANCE: f32 = 0.01;

/// Diffuse map of the room.
pub(super) fn diffuse_map(normal: Vec3) -> Vec3 {
    DARK.lerp(BRIGHT, 0.5 + 0.5 * normal.dot(DIR))
}

/// Radiance of the room.
pub(super) fn radiance(dir: Vec3) -> Vec3 {
    0.5 * (DARK + BRIGHT) + 0.75 * (BRIGHT - DARK) * dir.dot(DIR)
}

/// What a perfect mirror shows.
pub(super) fn mirrored(normal: Vec3) -> Vec3 {
    radiance((-VIEW).reflect(normal))
}

/// The light whose highlight surfaces have.
pub(super) fn real_light(direction: Vec3) -> RealLight {
    RealLight {
        id: 7,
        direction: direction.normalize(),
        position: None,
        color: LinearRgba::rgb(1.0, 0.9, 0.6),
        irradiance: 2.0,
        angular_radius: 0.05,
        fraction: 0.2,
    }
}

/// What white paper that faces the light shows of it.
pub(super) fn paper_radiance(light: &RealLight) -> Vec3 {
    light.color.to_vec3() * light.irradiance / PI
}

/// Highlight of a light, also where it is behind the surface.
pub(super) fn lobe(light: &RealLight, normal: Vec3, exponent: f32) -> Vec3 {
    let between = (light.direction + VIEW).normalize();
    paper_radiance(light) * normal.dot(between).max(0.0).powf(exponent)
}

pub(super) fn highlight(light: &RealLight, normal: Vec3, exponent: f32) -> Vec3 {
    if normal.dot(light.direction) > 0.0 { lobe(light, normal, exponent) } else { Vec3::ZERO }
}

/// A ball that reflects the room sharply.
pub(super) fn sharp(model: ClassicModel) -> ClassicStyle {
    ClassicStyle { model, roughness: Some(0.0), ..default() }
}

/// Shows only the reflection.
pub(super) fn mirror() -> ClassicStyle {
    let model = CombinedModel { diffuse: 0.0, specular: 0.0, reflection: 1.0, ..default() };
    sharp(ClassicModel::Combined(model))
}

/// The room with a ball in it.
pub(super) fn studio(material: impl Into<StandardMaterial>, style: ClassicStyle) -> Option<Studio> {
    let mut studio = Studio::new(SurfaceStyle::Engine)?;
    studio.set_ball(material, SurfaceStyle::Classic(style));
    studio.add_sky(DIR, DARK, BRIGHT);
    Some(studio)
}

/// Asserts that the ball shows a color that is known per normal. `None`: anything.
pub(super) fn assert_shows(picture: &Picture, what: &str, expected: impl Fn(Vec3) -> Option<Vec3>) {
    let (mut worst, mut brightest) = (0.0_f32, 0.0_f32);
    for (pixel, normal) in normals() {
        if let Some(expected) = expected(normal) {
            let expected = expected.clamp(Vec3::ZERO, Vec3::ONE);
            worst = worst.max((picture.linear(pixel) - expected).abs().max_element());
            brightest = brightest.max(expected.max_element());
        }
    }
    println!("{what}: off by {worst:.4}, up to {brightest:.2}");
    assert!(worst <= TOLERANCE, "{what}: {worst}");
}
