//! What a webcam delivers, and how it is doing.

use super::format::PixelFormat;
use crate::camera::FramePixels;
use bevy::prelude::*;
use std::time::{Duration, Instant};

/// A picture of a webcam.
pub(in crate::camera) struct Captured {
    pub(in crate::camera) pixels: FramePixels,
    /// When the picture was taken: the driver's time stamp (start of exposure or end of the transfer, as the driver has it)
    /// where it gives a plausible one, else the time of arrival.
    pub(in crate::camera) at: Instant,
    /// How long it took to decode.
    pub(in crate::camera) decode_time: Duration,
    /// Light it got compared with the usual pictures, at most 1.
    pub(in crate::camera) exposure: f32,
    /// Pictures of the usual exposure that were overwritten unseen, and empty or damaged ones, since the last one that was taken.
    pub(in crate::camera) dropped: u64,
}

/// How a webcam is doing.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::camera) enum WebcamStatus {
    /// It is being opened, and no picture has arrived yet.
    Opening,
    /// Pictures arrive.
    Playing(WebcamStream),
    /// No pictures arrive. The text names the camera, what happened and what to do. The thread keeps looking for the camera.
    Lost(String),
}

/// What a camera delivers. It may differ from the wishes.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::camera) struct WebcamStream {
    /// The camera's name.
    pub(in crate::camera) name: String,
    /// Width and height in pixels.
    pub(in crate::camera) size: UVec2,
    /// Pictures per second; 0 if the driver does not say.
    pub(in crate::camera) frame_rate: f32,
    /// How the pictures come out of the camera.
    pub(in crate::camera) format: PixelFormat,
    /// Seconds of light per picture if that was asked for and the camera does it.
    pub(in crate::camera) exposure: Option<f32>,
    /// Shares of it that the camera takes too.
    pub(in crate::camera) shorter_exposures: Vec<f32>,
}
