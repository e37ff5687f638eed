//! Cube maps that come back from the GPU.

use bevy::prelude::*;
use bevy_mirrorball::{environment_map::CubePixels, offscreen};

/// The first mip level of a cube of half floats as it is after one more frame.
pub(crate) fn read(app: &mut App, image: &Handle<Image>) -> CubePixels {
    let bytes = offscreen::read_texture(app, image).expect("the cube comes back");
    let edge = (bytes.len() as f64 / 48.0).sqrt() as u32;
    CubePixels::from_rgba16f(edge, &bytes).expect("a cube of half floats")
}
