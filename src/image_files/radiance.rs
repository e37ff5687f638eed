//! Radiance files.

use super::check_size;
use image::{DynamicImage, ImageFormat, ImageResult, Rgb32FImage, codecs::hdr::HdrDecoder};
use std::io::BufRead;

/// Decodes a Radiance file of `length` bytes. Its signature may be `#?RGBE` too, as some programs write. Pixels are
/// divided by the product of all `EXPOSURE` lines (Ward 1991, *Real pixels*); 0, which some programs write, counts as
/// none.
pub(super) fn decode(file: impl BufRead, length: u64) -> ImageResult<Rgb32FImage> {
    let decoder = HdrDecoder::new_nonstrict(file)?;
    let metadata = decoder.metadata();
    let size = (u64::from(metadata.width), u64::from(metadata.height));
    check_size(ImageFormat::Hdr, size, size_of::<[f32; 3]>() as u64, length)?;
    let exposure = metadata.exposure.filter(|exposure| exposure.is_finite() && *exposure > 0.0);
    let mut pixels = DynamicImage::from_decoder(decoder)?.into_rgb32f();
    if let Some(exposure) = exposure {
        pixels.iter_mut().for_each(|value| *value /= exposure);
    }
    Ok(pixels)
}
