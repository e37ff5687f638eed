//! Plausible sizes of images: a damaged file must not take all memory.

use image::{
    ImageFormat, ImageResult,
    error::{DecodingError, ImageError},
};

/// Decoded bytes that any file may have.
const ALWAYS_ALLOWED: u64 = 64 << 20;
/// Decoded bytes per byte of the file that a compression can reach. Deflate ends at 1032, JPEG with runs of empty
/// blocks and Radiance with runs of 127 values stay below.
const MAX_COMPRESSION: u64 = 4096;

/// Returns an error if a file of `length` bytes cannot hold an image of this size.
pub(crate) fn check_size(
    format: ImageFormat,
    (width, height): (u64, u64),
    bytes_per_pixel: u64,
    length: u64,
) -> ImageResult<()> {
    let bytes = width.saturating_mul(height).saturating_mul(bytes_per_pixel);
    if bytes <= ALWAYS_ALLOWED.max(length.saturating_mul(MAX_COMPRESSION)) {
        return Ok(());
    }
    let problem = format!("it is damaged: {length} bytes cannot hold the {width} × {height} pixels that it claims");
    Err(ImageError::Decoding(DecodingError::new(format.into(), problem)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_no_compression_reaches_is_refused() {
        let check = |size, length| check_size(ImageFormat::OpenExr, size, 12, length);
        assert!(check((2048, 1024), 100).is_ok(), "small images may be of one color");
        assert!(check((16384, 8192), 1_000_000).is_ok());
        assert!(check((16384, 8192), 10_000).is_err());
        let text = check((1 << 40, 1 << 40), 10_000).expect_err("overflows").to_string();
        assert!(text.contains("10000 bytes"), "{text}");
    }
}
