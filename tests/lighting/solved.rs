//! The light that a solution gives on surfaces.

use bevy::prelude::*;
use bevy_mirrorball::lighting::solver::SolvedLight;

/// The marker's normal and seven tilted by 53° against it.
pub(crate) fn normals() -> [Vec3; 8] {
    std::array::from_fn(|i| {
        if i == 7 {
            return Vec3::Y;
        }
        let azimuth = std::f32::consts::TAU * i as f32 / 7.0;
        let (sin, cos) = 53_f32.to_radians().sin_cos();
        Vec3::new(sin * azimuth.sin(), cos, -sin * azimuth.cos())
    })
}

/// Irradiance ÷ π from the upper half; what lies below is the desk, which the true map does not hold.
pub(crate) fn irradiance_from_above(light: &SolvedLight, normal: Vec3) -> Vec3 {
    let above = light.sky().filter(|(dir, ..)| dir.y > 0.0);
    above.map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal).max(0.0))).sum::<Vec3>()
        / std::f32::consts::PI
}

/// A lamp's irradiance at a surface that faces it, as solved: that of everything within 15° of it.
pub(crate) fn irradiance_from(solved: &SolvedLight, direction: Vec3) -> f32 {
    let near = solved.sky().filter(|(dir, ..)| dir.angle_between(direction) < 15_f32.to_radians());
    near.map(|(_, solid_angle, radiance)| radiance.element_sum() / 3.0 * solid_angle).sum()
}
