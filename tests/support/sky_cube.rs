//! Cubes filled from an equirectangular image, as with the environment files of users.

use bevy::prelude::*;
use bevy_mirrorball::environment_map::{EquirectPixels, equirect_direction};

/// A cube of what a sky sends from each direction, by way of an equirectangular image of as many texels per degree.
pub(crate) fn sky_cube(edge: u32, light: impl Fn(Vec3) -> Vec3) -> Image {
    let size = UVec2::new(4 * edge, 2 * edge);
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
    let picture = EquirectPixels {
        size,
        texels: pixels.map(|pixel| light(equirect_direction(pixel / size.as_vec2()))).collect(),
    };
    picture.to_cube(edge, Quat::IDENTITY).to_image()
}
