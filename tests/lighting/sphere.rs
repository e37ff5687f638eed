//! Evenly spread directions, each with the same solid angle.

use bevy::prelude::*;

/// Points spread evenly over the unit sphere (Fibonacci lattice), each standing for the same solid angle.
pub(crate) fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    let golden_angle = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let y = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let (sin, cos) = (i as f64 * golden_angle).sin_cos();
        let across = (1.0 - y * y).sqrt();
        Vec3::new((across * cos) as f32, y as f32, (across * sin) as f32)
    })
}

/// Directions spread evenly over the upper hemisphere (Fibonacci lattice).
pub(crate) fn upper_hemisphere(count: usize) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let y = (i as f32 + 0.5) / count as f32;
        let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        let across = (1.0 - y * y).sqrt();
        Vec3::new(across * cos as f32, y, across * sin as f32)
    })
}
