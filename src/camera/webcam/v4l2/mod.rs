//! Cameras on Linux, through the kernel's video interface V4L2.
//!
//! <https://docs.kernel.org/userspace-api/media/v4l/v4l2.html>

mod errors;
mod exposure;
mod modes;

use super::{
    devices::{DeviceInfo, DeviceOptions},
    format::{FrameRate, RawFrame, SourceFrame, choose},
    stream::WebcamStream,
};
use bevy::prelude::*;
use errors::{describe, title};
use exposure::{Exposures, expose};
use modes::{fourcc, modes, pixel_format};
use std::{
    fs, io,
    panic::catch_unwind,
    time::{Duration, Instant},
};
use v4l::{
    Device, Format, FourCC, Fraction,
    buffer::{Flags, Metadata, Type},
    capability::Flags as Capabilities,
    io::traits::{CaptureStream, Stream},
    prelude::MmapStream,
    video::{Capture, capture::Parameters},
};

/// Number of frame buffers shared with the driver.
const BUFFER_COUNT: u32 = 4;
/// Largest plausible age of a frame on arrival. Older time stamps are from another clock.
const MAX_FRAME_AGE: Duration = Duration::from_secs(10);

/// Lists the cameras that can capture. Their metadata nodes, which have the same names, cannot and are left out.
pub(super) fn list() -> Vec<DeviceInfo> {
    let Ok(entries) = fs::read_dir("/sys/class/video4linux") else {
        return Vec::new();
    };
    let camera = |entry: io::Result<fs::DirEntry>| {
        let entry = entry.ok()?;
        let index = entry.file_name().to_str()?.strip_prefix("video")?.parse().ok()?;
        let name = String::from_utf8_lossy(&fs::read(entry.path().join("name")).ok()?).trim().to_owned();
        can_capture(index).then_some(DeviceInfo { index, name })
    };
    entries.filter_map(camera).collect()
}

fn can_capture(index: u32) -> bool {
    match Device::new(index as usize) {
        // The library panics on names that are not UTF-8.
        Ok(device) => catch_unwind(move || device.query_caps())
            .is_ok_and(|caps| caps.is_ok_and(|caps| caps.capabilities.contains(Capabilities::VIDEO_CAPTURE))),
        // A camera that cannot be opened is listed, so that opening it reports the remedy to the user.
        Err(error) => matches!(error.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ResourceBusy),
    }
}

/// An open camera that delivers frames.
pub(super) struct Source {
    // Declared before the device, so that it is dropped first: it returns its buffers to the device.
    buffers: MmapStream<'static>,
    device: Device,
    info: DeviceInfo,
    stream: WebcamStream,
    stride: usize,
    exposures: Exposures,
}

impl Source {
    /// Opens the camera and starts it in the mode that is nearest to the requested one.
    pub(super) fn open(info: &DeviceInfo, options: &DeviceOptions) -> Result<Self, String> {
        let failed = |what: &str| {
            let info = info.clone();
            let what = what.to_owned();
            move |error: io::Error| describe(&info, &what, &error)
        };
        let device = Device::new(info.index as usize).map_err(failed("cannot be opened"))?;
        let modes = modes(&device, options).map_err(failed("does not tell its modes"))?;
        let mode = choose(&modes, options).ok_or_else(|| {
            let known = "YUYV, NV12, RGB, BGR, MJPEG or gray";
            format!("{} has no mode in one of the formats {known}. Take another camera", title(info))
        })?;
        // Set before anything else is queried, because another program may have left any format behind.
        let wanted = Format::new(mode.size.x, mode.size.y, FourCC::new(fourcc(mode.format)));
        let format = device.set_format(&wanted).map_err(failed("does not take its own mode"))?;
        let size = UVec2::new(format.width, format.height);
        let pixel_format = pixel_format(format.fourcc).filter(|_| size.min_element() > 0).ok_or_else(|| {
            format!("{} gives {} instead of {}. Ask for another size", title(info), format.fourcc, mode.format.name())
        })?;
        // Drivers without adjustable rates refuse this and deliver at their own rate.
        let interval = mode.rate.map(|rate| Fraction::new(rate.seconds, rate.frames));
        let rate = interval.and_then(|interval| device.set_params(&Parameters::new(interval)).ok());
        let rate = rate.or_else(|| device.params().ok()).map(|parameters| parameters.interval);
        let rate = rate.and_then(|interval| FrameRate::new(interval.denominator, interval.numerator));
        let exposures = expose(&device, info, options);
        let stream = WebcamStream {
            name: info.name.clone(),
            size,
            frame_rate: rate.map_or(0.0, FrameRate::per_second),
            format: pixel_format,
            exposure: exposures.seconds(),
            shorter_exposures: exposures.shorter(),
        };
        let buffers = start(&device).map_err(failed("does not start"))?;
        Ok(Self { buffers, device, info: info.clone(), stream, stride: format.stride as usize, exposures })
    }

    pub(super) fn stream(&self) -> &WebcamStream {
        &self.stream
    }

    /// Changes the exposure to the usual one, step 0, or to one of the shorter ones.
    pub(super) fn change_exposure(&mut self, step: usize) -> Result<(), String> {
        self.exposures.set(&self.device, &self.info, step)
    }

    /// Waits for the next frame, but not longer than `limit`.
    pub(super) fn next(&mut self, limit: Duration) -> Result<Option<SourceFrame<'_>>, String> {
        const READABLE: i16 = libc::POLLIN;
        match self.device.handle().poll(READABLE, limit.as_millis() as i32) {
            Ok(0) => return Ok(None),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Ok(None),
            Err(error) => return Err(describe(&self.info, "stopped", &error)),
            Ok(_) => {}
        }
        let (bytes, meta) = self.buffers.next().map_err(|error| describe(&self.info, "stopped", &error))?;
        let used = (meta.bytesused as usize).min(bytes.len());
        Ok(Some(SourceFrame {
            raw: RawFrame {
                bytes: &bytes[..used],
                format: self.stream.format,
                size: self.stream.size,
                stride: self.stride,
            },
            at: taken_at(meta),
            is_marked_damaged: meta.flags.contains(Flags::ERROR),
        }))
    }
}

/// Queues all buffers except the first and starts the stream. Before the library waits for a frame, it queues the
/// buffer that was read last, which is initially the first one.
fn start(device: &Device) -> io::Result<MmapStream<'static>> {
    let mut buffers = MmapStream::with_buffers(device, Type::VideoCapture, BUFFER_COUNT)?;
    buffers.set_timeout(Duration::from_secs(1));
    CaptureStream::queue(&mut buffers, 1)?;
    // A driver may allocate fewer buffers than requested.
    for index in 2..BUFFER_COUNT as usize {
        if CaptureStream::queue(&mut buffers, index).is_err() {
            break;
        }
    }
    buffers.start()?;
    Ok(buffers)
}

/// Returns when the frame was captured: the driver's time stamp if it is from the clock that [`Instant`] uses and
/// neither in the future nor long ago, otherwise the time of arrival.
fn taken_at(meta: &Metadata) -> Instant {
    let arrived = Instant::now();
    if meta.flags & Flags::TIMESTAMP_MASK != Flags::TIMESTAMP_MONOTONIC {
        return arrived;
    }
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: the clock is valid and the pointer points to a live `timespec`.
    if unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) } != 0 {
        return arrived;
    }
    let now = Duration::from_secs(now.tv_sec.try_into().unwrap_or(0))
        + Duration::from_nanos(now.tv_nsec.try_into().unwrap_or(0));
    let stamp = Duration::from_secs(meta.timestamp.sec.try_into().unwrap_or(0))
        + Duration::from_micros(meta.timestamp.usec.try_into().unwrap_or(0));
    let age = now.saturating_sub(stamp);
    if age > MAX_FRAME_AGE { arrived } else { arrived.checked_sub(age).unwrap_or(arrived) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_of_another_clock_or_of_the_future_become_the_arrival() {
        let arrival = Instant::now();
        let mut meta = Metadata::default();
        assert!(taken_at(&meta) >= arrival);
        meta.flags = Flags::TIMESTAMP_MONOTONIC;
        meta.timestamp = v4l::Timestamp::new(i64::MAX / 2_000_000, 0);
        assert!(taken_at(&meta) >= arrival);
        meta.timestamp = v4l::Timestamp::new(-1_000_000, 0);
        assert!(taken_at(&meta) >= arrival);
    }
}
