//! Pixel formats, raw frames and modes of cameras, and the choice of a mode.

use super::devices::{DeviceEncoding, DeviceOptions};
use bevy::prelude::*;
use std::{cmp::Ordering, time::Instant};

/// Encoding of a camera's frames. The order is the order of preference at equal size and rate: uncompressed before
/// JPEG, whose blocks soften corners and colors; gray last, because light without color is half a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::camera) enum PixelFormat {
    /// `Y'CbCr` 4:2:2, two pixels in four bytes: Y'₀ Cb Y'₁ Cr.
    Yuyv,
    /// `Y'CbCr` 4:2:0: a plane of Y', then one of Cb and Cr in turn at half the width and height.
    Nv12,
    /// Red, green, blue; one byte each.
    Rgb,
    /// Blue, green, red; one byte each.
    Bgr,
    /// One JPEG per frame.
    Mjpeg,
    /// One byte of luma per pixel.
    Gray,
}

impl PixelFormat {
    /// Name of the format in the system's tools.
    pub(in crate::camera) fn name(self) -> &'static str {
        match self {
            Self::Yuyv => "YUYV",
            Self::Nv12 => "NV12",
            Self::Rgb => "RGB",
            Self::Bgr => "BGR",
            Self::Mjpeg => "MJPEG",
            Self::Gray => "gray",
        }
    }

    /// Bytes of one row without padding; zero for JPEG, which has no rows of equal length.
    pub(super) fn row_bytes(self, width: u32) -> usize {
        let width = width as usize;
        match self {
            Self::Yuyv => width.div_ceil(2) * 4,
            Self::Nv12 => width.next_multiple_of(2),
            Self::Rgb | Self::Bgr => width * 3,
            Self::Gray => width,
            Self::Mjpeg => 0,
        }
    }
}

/// An encoded frame as the driver delivered it.
pub(super) struct RawFrame<'a> {
    /// The bytes that arrived, which may be fewer than a whole frame.
    pub(super) bytes: &'a [u8],
    pub(super) format: PixelFormat,
    pub(super) size: UVec2,
    /// Bytes from one row to the next; a value less than a row means that rows are not padded.
    pub(super) stride: usize,
}

/// A raw frame with what the camera's source knows about it.
pub(super) struct SourceFrame<'a> {
    pub(super) raw: RawFrame<'a>,
    /// When the frame was captured, or when it arrived where no plausible time stamp exists.
    pub(super) at: Instant,
    /// Whether the driver reports an error in this frame. Always `false` where `nokhwa` is used, which does not report
    /// it.
    pub(super) is_marked_damaged: bool,
}

/// Why a frame cannot be used.
#[derive(thiserror::Error, Clone, Debug, PartialEq, Eq)]
pub(super) enum DecodeError {
    #[error("the picture is empty")]
    Empty,
    #[error("only {got} of {expected} bytes arrived")]
    Short { expected: usize, got: usize },
    #[error("the JPEG is damaged: {0}")]
    Jpeg(String),
    #[error("the driver marked it as damaged")]
    Marked,
}

/// Frame rate in the form that drivers use: a whole number of frames in a whole number of seconds (15 / 2 is 7.5).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FrameRate {
    pub(super) frames: u32,
    pub(super) seconds: u32,
}

impl FrameRate {
    pub(super) fn new(frames: u32, seconds: u32) -> Option<Self> {
        (frames > 0 && seconds > 0).then_some(Self { frames, seconds })
    }

    pub(super) fn per_second(self) -> f32 {
        self.frames as f32 / self.seconds as f32
    }
}

/// A combination of format, size and rate that a camera supports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mode {
    pub(super) format: PixelFormat,
    pub(super) size: UVec2,
    /// `None` if the driver does not report it.
    pub(super) rate: Option<FrameRate>,
}

/// Largest relative difference at which a rate counts as equal to the requested one: 29.97 is as good as 30.
const MAX_RATE_DIFFERENCE: f32 = 0.05;
/// Cost of a rate that the driver does not report: that of a rate about a third off.
const UNKNOWN_RATE_COST: f32 = 0.3;

/// Chooses the mode with the requested encoding if there is one, then the nearest size, then the nearest rate, then the
/// preferred format. Distances are ratios, so that half is as far as double.
pub(super) fn choose(modes: &[Mode], options: &DeviceOptions) -> Option<Mode> {
    let (size, frame_rate) = (options.wished_size(), options.wished_frame_rate());
    let is_other_encoding = |mode: &Mode| match options.encoding {
        DeviceEncoding::Any => false,
        DeviceEncoding::Uncompressed => mode.format == PixelFormat::Mjpeg,
        DeviceEncoding::Jpeg => mode.format != PixelFormat::Mjpeg,
    };
    let ratio = |a: f32, b: f32| (a / b).ln().abs();
    let size_cost = |mode: &Mode| {
        let (is, wish) = (mode.size.as_vec2(), size.as_vec2());
        ratio(is.x, wish.x) + ratio(is.y, wish.y)
    };
    let rate_cost = |mode: &Mode| match mode.rate {
        None => UNKNOWN_RATE_COST,
        Some(rate) if ratio(rate.per_second(), frame_rate) <= MAX_RATE_DIFFERENCE => 0.0,
        Some(rate) => ratio(rate.per_second(), frame_rate),
    };
    let order = |a: &Mode, b: &Mode| -> Ordering {
        (is_other_encoding(a).cmp(&is_other_encoding(b)))
            .then(size_cost(a).total_cmp(&size_cost(b)))
            .then(rate_cost(a).total_cmp(&rate_cost(b)))
            .then(a.format.cmp(&b.format))
    };
    modes.iter().filter(|mode| mode.size.min_element() > 0).copied().min_by(order)
}

#[cfg(test)]
mod tests {
    use super::*;

    const VGA: UVec2 = UVec2::new(640, 480);
    const HD: UVec2 = UVec2::new(1280, 720);

    fn mode(format: PixelFormat, size: UVec2, frames: u32, seconds: u32) -> Mode {
        Mode { format, size, rate: FrameRate::new(frames, seconds) }
    }

    fn chosen(modes: &[Mode], size: UVec2, frame_rate: f32) -> Option<Mode> {
        choose(modes, &DeviceOptions { size: Some(size), frame_rate: Some(frame_rate), ..default() })
    }

    #[test]
    fn the_nearest_size_comes_before_rate_and_format() {
        let modes = [
            mode(PixelFormat::Yuyv, HD, 30, 1),
            mode(PixelFormat::Gray, VGA, 5, 1),
            mode(PixelFormat::Mjpeg, HD, 60, 1),
        ];
        assert_eq!(chosen(&modes, VGA, 30.0), Some(modes[1]));
        assert_eq!(chosen(&modes, UVec2::new(1200, 700), 60.0), Some(modes[2]));
        assert_eq!(chosen(&[], VGA, 30.0), None);
    }

    #[test]
    fn jpeg_is_taken_when_only_it_reaches_the_rate() {
        let modes = [mode(PixelFormat::Yuyv, VGA, 15, 2), mode(PixelFormat::Mjpeg, VGA, 30, 1)];
        assert_eq!(chosen(&modes, VGA, 30.0), Some(modes[1]));
        assert_eq!(chosen(&modes, VGA, 8.0), Some(modes[0]));
    }

    #[test]
    fn uncompressed_is_taken_at_equal_rates_and_a_broadcast_rate_is_equal_to_its_round_one() {
        let modes = [mode(PixelFormat::Mjpeg, VGA, 30, 1), mode(PixelFormat::Yuyv, VGA, 30_000, 1001)];
        assert_eq!(chosen(&modes, VGA, 30.0), Some(modes[1]));
    }

    #[test]
    fn a_mode_without_a_size_is_never_taken_and_one_without_a_rate_may_be() {
        let unknown = Mode { format: PixelFormat::Yuyv, size: VGA, rate: FrameRate::new(0, 1) };
        assert_eq!(chosen(&[mode(PixelFormat::Yuyv, UVec2::new(0, 480), 30, 1), unknown], VGA, 30.0), Some(unknown));
        assert_eq!(chosen(&[mode(PixelFormat::Yuyv, VGA, 5, 1), unknown], VGA, 30.0), Some(unknown));
    }

    #[test]
    fn a_wished_encoding_is_taken_where_there_is_one() {
        let modes = [mode(PixelFormat::Yuyv, VGA, 30, 1), mode(PixelFormat::Mjpeg, HD, 30, 1)];
        let chosen = |modes: &[Mode], encoding| choose(modes, &DeviceOptions { encoding, ..default() });
        assert_eq!(chosen(&modes, DeviceEncoding::Jpeg), Some(modes[1]));
        assert_eq!(chosen(&modes, DeviceEncoding::Uncompressed), Some(modes[0]));
        assert_eq!(chosen(&modes[1..], DeviceEncoding::Uncompressed), Some(modes[1]));
    }
}
