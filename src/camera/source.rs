//! Interface of frame sources, which feeds poll once per update.

use super::{CameraError, FeedState, FramePixels, Intrinsics};
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// A source of frames.
pub(super) trait FrameSource: Send + Sync {
    /// Returns what has happened since the last call. `now` is the elapsed [`Time<Real>`].
    fn poll(&mut self, now: Duration) -> Arrival;

    /// How markers were tracked when the source was recorded, if it is a recording.
    fn tracking(&self) -> Option<&serde_json::Value> {
        None
    }
}

/// Result of polling a source.
#[derive(Default)]
pub(super) struct Arrival {
    /// Newest frame of the normal exposure.
    pub frame: Option<SourceFrame>,
    /// Frames of shorter exposures.
    pub bracketed: Vec<SourceFrame>,
    /// Number of frames of the normal exposure that were skipped before `frame`, plus damaged ones.
    pub dropped: u64,
    /// New state of the feed, set when a source fails. A frame in the same arrival means [`FeedState::Playing`]
    /// anyway.
    pub state: Option<FeedState>,
}

impl Arrival {
    pub(super) fn lost(error: &CameraError) -> Self {
        Self { dropped: 1, state: Some(FeedState::Lost(error.to_string())), ..default() }
    }

    pub(super) fn failed(error: &CameraError) -> Self {
        Self { state: Some(FeedState::Failed(error.to_string())), ..default() }
    }
}

/// A frame as its source delivers it.
#[derive(Clone, Debug)]
pub(super) struct SourceFrame {
    pub pixels: Arc<FramePixels>,
    pub captured: Duration,
    pub decode_time: Duration,
    pub intrinsics: Option<Intrinsics>,
    /// Exposure relative to the normal frames, which have 1.
    pub exposure: f32,
}
