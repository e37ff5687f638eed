//! Rendered bytes as an image of the `image` crate.

use bevy::math::UVec2;
use image::RgbImage;

/// Converts rows of RGBA bytes to an image; alpha is dropped.
pub(crate) fn rgb_image(size: UVec2, rgba: &[u8]) -> Result<RgbImage, &'static str> {
    let rgb = rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    RgbImage::from_raw(size.x, size.y, rgb).ok_or("the picture came back in the wrong size")
}
