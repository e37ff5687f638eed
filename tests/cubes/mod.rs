//! Cube maps that come back from the GPU, and directions to ask them about.

#![allow(dead_code, reason = "each test file uses a part")]

use bevy::prelude::*;
use bevy_mirrorball::{environment_map::CubePixels, headless};

/// The first mip level of a cube of half floats as it is after one more frame.
pub(crate) fn read(app: &mut App, image: &Handle<Image>) -> CubePixels {
    let bytes = headless::read_texture(app, image).expect("the cube comes back");
    let edge = (bytes.len() as f64 / 48.0).sqrt() as u32;
    CubePixels::from_rgba16f(edge, &bytes).expect("a cube of half floats")
}

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
