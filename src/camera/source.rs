//! What is behind a feed: something that is asked for its newest picture once an update.

use super::{CameraError, FeedState, FramePixels, Intrinsics};
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// Gives the newest picture.
pub(super) trait FrameSource: Send + Sync {
    /// What has happened since the last call; `now` is the elapsed [`Time<Real>`].
    fn poll(&mut self, now: Duration) -> Arrival;
}

/// What a source has to say.
#[derive(Default)]
pub(super) struct Arrival {
    /// The newest one of the usual exposure.
    pub frame: Option<SourceFrame>,
    /// Those of shorter exposures.
    pub bracketed: Vec<SourceFrame>,
    /// Pictures of the usual exposure skipped before `picture`, and damaged ones.
    pub dropped: u64,
    /// Said by sources that are in trouble; a picture means [`FeedState::Playing`] anyway.
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

/// A picture that has come out of a source.
#[derive(Clone, Debug)]
pub(super) struct SourceFrame {
    pub pixels: Arc<FramePixels>,
    pub captured: Duration,
    pub decode_time: Duration,
    pub intrinsics: Option<Intrinsics>,
    /// Light it got, the usual picture's being 1.
    pub exposure: f32,
}
