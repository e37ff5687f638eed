//! Modes of a V4L2 camera, converted to this crate's types.

use crate::camera::webcam::{
    devices::DeviceOptions,
    format::{FrameRate, Mode, PixelFormat},
};
use bevy::prelude::*;
use std::io;
use v4l::{Device, FourCC, Fraction, frameinterval::FrameIntervalEnum, framesize::FrameSizeEnum, video::Capture};

/// Lists the camera's modes whose format can be decoded. Ranges of sizes or rates are represented by the value nearest
/// to the requested one.
pub(super) fn modes(device: &Device, options: &DeviceOptions) -> io::Result<Vec<Mode>> {
    let mut modes = Vec::new();
    for description in device.enum_formats()? {
        let (code, Some(format)) = (description.fourcc, pixel_format(description.fourcc)) else {
            continue;
        };
        for frame_size in device.enum_framesizes(code).unwrap_or_default() {
            let size = match frame_size.size {
                FrameSizeEnum::Discrete(size) => UVec2::new(size.width, size.height),
                FrameSizeEnum::Stepwise(range) => {
                    let wish = options.wished_size();
                    UVec2::new(
                        nearest_step(wish.x, range.min_width, range.max_width, range.step_width),
                        nearest_step(wish.y, range.min_height, range.max_height, range.step_height),
                    )
                }
            };
            let intervals = device.enum_frameintervals(code, size.x, size.y).unwrap_or_default();
            if intervals.is_empty() {
                modes.push(Mode { format, size, rate: None });
            }
            modes.extend(intervals.into_iter().map(|interval| {
                let rate = nearest_rate(&interval.interval, options.wished_frame_rate());
                Mode { format, size, rate }
            }));
        }
    }
    Ok(modes)
}

fn nearest_step(wish: u32, min: u32, max: u32, step: u32) -> u32 {
    let step = step.max(1);
    let inside = wish.clamp(min, max.max(min)) - min;
    min + inside / step * step
}

fn nearest_rate(interval: &FrameIntervalEnum, wish: f32) -> Option<FrameRate> {
    let rate = |interval: &Fraction| FrameRate::new(interval.denominator, interval.numerator);
    match interval {
        FrameIntervalEnum::Discrete(interval) => rate(interval),
        FrameIntervalEnum::Stepwise(range) => {
            let (fastest, slowest) = (rate(&range.min)?, rate(&range.max)?);
            if wish >= fastest.per_second() {
                Some(fastest)
            } else if wish <= slowest.per_second() {
                Some(slowest)
            } else {
                FrameRate::new((1000.0 * wish) as u32, 1000)
            }
        }
    }
}

pub(super) fn fourcc(format: PixelFormat) -> &'static [u8; 4] {
    match format {
        PixelFormat::Yuyv => b"YUYV",
        PixelFormat::Nv12 => b"NV12",
        PixelFormat::Rgb => b"RGB3",
        PixelFormat::Bgr => b"BGR3",
        PixelFormat::Mjpeg => b"MJPG",
        PixelFormat::Gray => b"GREY",
    }
}

pub(super) fn pixel_format(code: FourCC) -> Option<PixelFormat> {
    use PixelFormat::*;
    [Yuyv, Nv12, Rgb, Bgr, Mjpeg, Gray].into_iter().find(|&format| code.repr == *fourcc(format))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_met_at_the_wish_or_their_nearest_end() {
        assert_eq!(nearest_step(640, 16, 1920, 16), 640);
        assert_eq!(nearest_step(650, 16, 1920, 16), 640);
        assert_eq!(nearest_step(5000, 16, 1920, 16), 1920);
        assert_eq!(nearest_step(1, 16, 1920, 0), 16);
        let fraction = Fraction::new;
        let range = v4l::frameinterval::Stepwise { min: fraction(1, 60), max: fraction(1, 5), step: fraction(1, 60) };
        let range = FrameIntervalEnum::Stepwise(range);
        let rate = |wish| nearest_rate(&range, wish).map(FrameRate::per_second);
        assert_eq!((rate(30.0), rate(100.0), rate(1.0)), (Some(30.0), Some(60.0), Some(5.0)));
        assert_eq!(nearest_rate(&FrameIntervalEnum::Discrete(fraction(0, 30)), 30.0), None);
    }
}
