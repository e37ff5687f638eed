//! Captured frames, status and stream parameters of a webcam.

use super::format::PixelFormat;
use crate::camera::FramePixels;
use bevy::prelude::*;
use std::time::{Duration, Instant};

/// A decoded frame of a webcam.
pub(in crate::camera) struct Captured {
    pub(in crate::camera) pixels: FramePixels,
    /// When the frame was captured: the driver's time stamp (start of exposure or end of transfer, depending on the
    /// driver) if it is plausible, otherwise the time of arrival.
    pub(in crate::camera) at: Instant,
    /// Time that decoding took.
    pub(in crate::camera) decode_time: Duration,
    /// Exposure relative to the usual exposure, at most 1.
    pub(in crate::camera) exposure: f32,
    /// Number of frames of the usual exposure that were overwritten unread, and of empty or damaged frames, since the
    /// last frame that was taken.
    pub(in crate::camera) dropped: u64,
}

/// Status of a webcam.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::camera) enum WebcamStatus {
    /// The camera is being opened, and no frame has arrived yet.
    Opening,
    /// Frames arrive.
    Playing(WebcamStream),
    /// No frames arrive. The text names the camera, what happened and what to do. The thread keeps searching for the
    /// camera.
    Lost(String),
}

/// Parameters of the stream that a camera delivers. They may differ from the requested ones.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::camera) struct WebcamStream {
    /// Name of the camera.
    pub(in crate::camera) name: String,
    /// Width and height in pixels.
    pub(in crate::camera) size: UVec2,
    /// Frames per second; 0 if the driver does not report it.
    pub(in crate::camera) frame_rate: f32,
    /// Encoding of the frames.
    pub(in crate::camera) format: PixelFormat,
    /// Exposure time in seconds, if one was requested and the camera accepted it.
    pub(in crate::camera) exposure: Option<f32>,
    /// Shorter exposures that the camera takes in between, as fractions of the usual one.
    pub(in crate::camera) shorter_exposures: Vec<f32>,
}
