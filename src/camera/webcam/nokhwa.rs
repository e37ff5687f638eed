//! Cameras on Windows and macOS, through `nokhwa`.
//!
//! Not tested on these systems. The same code captures frames on Linux.

use super::{
    devices::{DeviceExposure, DeviceInfo, DeviceOptions},
    format::{FrameRate, Mode, PixelFormat, RawFrame, SourceFrame, choose},
    stream::WebcamStream,
};
use bevy::prelude::*;
use nokhwa::{
    Buffer, Camera, NokhwaError, query,
    utils::{ApiBackend, CameraFormat, CameraIndex, FrameFormat, RequestedFormat, RequestedFormatType, Resolution},
};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Largest plausible age of a frame on arrival. Older time stamps are from another clock.
const MAX_FRAME_AGE: Duration = Duration::from_secs(10);

/// Lists the cameras that the system knows.
pub(super) fn list() -> Vec<DeviceInfo> {
    ask_for_permission();
    let camera = |info: nokhwa::utils::CameraInfo| {
        Some(DeviceInfo { index: info.index().as_index().ok()?, name: info.human_name() })
    };
    query(ApiBackend::Auto).unwrap_or_default().into_iter().filter_map(camera).collect()
}

/// Asks the user for access to cameras, which macOS requires. The answer takes effect at the next search.
fn ask_for_permission() {
    if !nokhwa::nokhwa_check() {
        nokhwa::nokhwa_initialize(|_| {});
    }
}

/// An open camera that delivers frames.
pub(super) struct Source {
    camera: Camera,
    info: DeviceInfo,
    stream: WebcamStream,
    newest: Option<Buffer>,
}

impl Source {
    /// Opens the camera and starts it in the mode that is nearest to the requested one.
    pub(super) fn open(info: &DeviceInfo, options: &DeviceOptions) -> Result<Self, String> {
        let failed = |what: &'static str| move |error: NokhwaError| describe(info, what, &error);
        let known = FORMATS.map(|(format, _)| format);
        let request = RequestedFormat::with_formats(RequestedFormatType::None, &known);
        let mut camera = Camera::new(CameraIndex::Index(info.index), request).map_err(failed("cannot be opened"))?;
        let formats = camera.compatible_camera_formats().map_err(failed("does not tell its modes"))?;
        let modes: Vec<_> = formats.iter().filter_map(mode).collect();
        let mode = choose(&modes, options).ok_or_else(|| {
            format!("the camera \"{}\" has no mode that can be decoded. Take another camera", info.name)
        })?;
        let rate = mode.rate.map_or(0, |rate| rate.frames);
        let exact = CameraFormat::new(Resolution::new(mode.size.x, mode.size.y), frame_format(mode.format), rate);
        let request = RequestedFormat::with_formats(RequestedFormatType::Exact(exact), &known);
        let got = camera.set_camera_requset(request).map_err(failed("does not take its own mode"))?;
        camera.open_stream().map_err(failed("does not start"))?;
        if options.exposure != DeviceExposure::Unchanged || !options.shorter_exposures.is_empty() {
            warn!("the exposure of the camera \"{}\" stays as it is: it can be set on Linux only", info.name);
        }
        let stream = WebcamStream {
            name: info.name.clone(),
            size: UVec2::new(got.width(), got.height()),
            frame_rate: got.frame_rate() as f32,
            format: mode.format,
            exposure: None,
            shorter_exposures: Vec::new(),
        };
        Ok(Self { camera, info: info.clone(), stream, newest: None })
    }

    pub(super) fn stream(&self) -> &WebcamStream {
        &self.stream
    }

    /// Changes the exposure to another step of the bracket. Does nothing, because there is only one step here.
    pub(super) fn change_exposure(&mut self, _step: usize) -> Result<(), String> {
        Ok(())
    }

    /// Waits for the next frame without a time limit, because the library has none.
    pub(super) fn next(&mut self, _limit: Duration) -> Result<Option<SourceFrame<'_>>, String> {
        let buffer = self.camera.frame().map_err(|error| describe(&self.info, "stopped", &error))?;
        let buffer = self.newest.insert(buffer);
        let (size, format) = (buffer.resolution(), buffer.source_frame_format());
        let format = FORMATS.iter().find(|(theirs, _)| *theirs == format).map(|&(_, ours)| ours);
        let at = taken_at(buffer);
        Ok(format.map(|format| SourceFrame {
            raw: RawFrame { bytes: buffer.buffer(), format, size: UVec2::new(size.width(), size.height()), stride: 0 },
            at,
            is_marked_damaged: false,
        }))
    }
}

const FORMATS: [(FrameFormat, PixelFormat); 6] = [
    (FrameFormat::YUYV, PixelFormat::Yuyv),
    (FrameFormat::NV12, PixelFormat::Nv12),
    (FrameFormat::RAWRGB, PixelFormat::Rgb),
    (FrameFormat::RAWBGR, PixelFormat::Bgr),
    (FrameFormat::MJPEG, PixelFormat::Mjpeg),
    (FrameFormat::GRAY, PixelFormat::Gray),
];

fn frame_format(format: PixelFormat) -> FrameFormat {
    FORMATS.iter().find(|(_, ours)| *ours == format).map_or(FrameFormat::MJPEG, |&(theirs, _)| theirs)
}

fn mode(theirs: &CameraFormat) -> Option<Mode> {
    let format = FORMATS.iter().find(|(format, _)| *format == theirs.format())?.1;
    let size = UVec2::new(theirs.width(), theirs.height());
    Some(Mode { format, size, rate: FrameRate::new(theirs.frame_rate(), 1) })
}

/// Returns when the frame was captured: the library's time stamp, which is a time of day, if it is plausible, otherwise
/// the time of arrival.
fn taken_at(buffer: &Buffer) -> Instant {
    let arrived = Instant::now();
    let taken = buffer.capture_timestamp().map(|since_epoch| UNIX_EPOCH + since_epoch);
    let age = taken.and_then(|taken| SystemTime::now().duration_since(taken).ok()).unwrap_or_default();
    if age > MAX_FRAME_AGE { arrived } else { arrived.checked_sub(age).unwrap_or(arrived) }
}

/// Returns a message that says what happened to the camera and what to do.
fn describe(info: &DeviceInfo, what: &str, error: &NokhwaError) -> String {
    format!(
        "the camera \"{}\" (number {}) {what}: {error}. Close other programs that use it, allow cameras in the system's \
         privacy settings, or plug it in again; it is found by itself",
        info.name, info.index
    )
}
