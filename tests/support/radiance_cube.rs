//! Cubes that hold a function of direction exactly at the centers of their texels.

use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    math::DVec3,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension},
};

/// World direction of the center of texel `i` of a cube, and its solid angle by Gauss–Bonnet.
pub(crate) fn texel(edge: usize, i: usize) -> (DVec3, f64) {
    let (face, row, column) = (i / (edge * edge), i / edge % edge, i % edge);
    let at = |k: f64| 2.0 * k / edge as f64 - 1.0;
    let (x, y) = (at(column as f64 + 0.5), at(row as f64 + 0.5));
    // Layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame: the world's z is the negative.
    let dir = match face {
        0 => DVec3::new(1.0, -y, -x),
        1 => DVec3::new(-1.0, -y, x),
        2 => DVec3::new(x, 1.0, y),
        3 => DVec3::new(x, -1.0, -y),
        4 => DVec3::new(x, -y, 1.0),
        _ => DVec3::new(-x, -y, -1.0),
    };
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    let (left, right) = (at(column as f64), at(column as f64 + 1.0));
    let (top, bottom) = (at(row as f64), at(row as f64 + 1.0));
    let solid_angle = corner(right, bottom) + corner(left, top) - corner(left, bottom) - corner(right, top);
    (dir.normalize() * DVec3::new(1.0, 1.0, -1.0), solid_angle)
}

/// Radiance of each texel, rounded to what half floats hold.
pub(crate) fn texels(edge: usize, radiance: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    let rounded = |v: f64| half::f16::from_f64(v.clamp(0.0, 65504.0)).to_f64();
    (0..6 * edge * edge).map(|i| radiance(texel(edge, i).0).map(rounded)).collect()
}

/// The cube of these texels, as materials sample it.
pub(crate) fn cube_image(edge: usize, texels: &[DVec3]) -> Image {
    let bytes =
        texels.iter().flat_map(|l| [l.x, l.y, l.z, 1.0].into_iter().flat_map(|v| half::f16::from_f64(v).to_le_bytes()));
    let extent = Extent3d { width: edge as u32, height: edge as u32, depth_or_array_layers: 6 };
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new(extent, TextureDimension::D2, bytes.collect(), format, RenderAssetUsages::RENDER_WORLD);
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    image.sampler = ImageSampler::linear();
    image
}
