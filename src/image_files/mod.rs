//! Files with linear values: Radiance (`.hdr`) and OpenEXR (`.exr`), for environments, camera frames and photographs
//! of balls alike.
//!
//! Values leave as the file has them: linear, not clipped, and possibly negative, infinite or not a number.

mod open_exr;
mod radiance;
mod shrink;
mod size_limit;

pub(crate) use shrink::shrink;
pub(crate) use size_limit::check_size;

use crate::panic_text::panic_text;
use image::{ImageFormat, ImageResult, Rgb32FImage, error::DecodingError, error::ImageError};
use std::{
    fs::File,
    io::BufReader,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

/// Largest value taken from a file: far above any light, and far below the limit of sums over all texels.
const MAX_RADIANCE: f32 = 1e20;

/// A value of a file as radiance: 0 if it is negative or not a number; 65504, the largest value of an environment cube,
/// if it is infinite.
pub(crate) fn clean_radiance(value: f32) -> f32 {
    match value {
        f32::INFINITY => half::f16::MAX.to_f32(),
        _ if value.is_nan() => 0.0,
        _ => value.clamp(0.0, MAX_RADIANCE),
    }
}

/// Returns whether files of this format hold linear values.
pub(crate) fn is_linear(format: ImageFormat) -> bool {
    matches!(format, ImageFormat::Hdr | ImageFormat::OpenExr)
}

/// Decodes a Radiance or OpenEXR file. Other formats are an error.
pub(crate) fn open_linear(path: &Path, format: ImageFormat) -> ImageResult<Rgb32FImage> {
    let file = File::open(path)?;
    let length = file.metadata()?.len();
    let file = BufReader::new(file);
    without_panic(format, || match format {
        ImageFormat::OpenExr => open_exr::decode(file, length),
        _ => radiance::decode(file, length),
    })
}

/// Runs a decoder and turns a panic of it into an error: some of them count on files to be undamaged.
pub(crate) fn without_panic<T>(format: ImageFormat, decode: impl FnOnce() -> ImageResult<T>) -> ImageResult<T> {
    // What the decoder worked on is dropped with it.
    catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|panic| {
        let reason = panic_text(&*panic).unwrap_or("no reason given");
        let problem = format!("it is damaged, the decoder gave up: {reason}");
        Err(ImageError::Decoding(DecodingError::new(format.into(), problem)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_decoder_that_panics_is_an_error() {
        let text = without_panic::<()>(ImageFormat::Hdr, || panic!("on row {}", 7)).expect_err("it panics").to_string();
        assert!(text.contains("on row 7"), "{text}");
    }
}
