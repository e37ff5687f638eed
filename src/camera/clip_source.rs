//! Frame source that plays a recorded clip.

use super::{
    CameraError, Clip, ClipAsset, FeedPace, FeedState,
    image_file::{Decoded, EncodedImage},
    source::{Arrival, FrameSource, SourceFrame},
};
use crate::frame_tasks::spawn_for_frame;
use bevy::{
    prelude::*,
    tasks::{Task, futures::check_ready},
};
use std::{ops::RangeInclusive, path::Path, sync::Arc, time::Duration};

/// A clip and its playback position.
pub(super) struct ClipSource {
    clip: Clip,
    /// Bytes of the files, if they are in memory.
    loaded: Option<Vec<Arc<[u8]>>>,
    pace: FeedPace,
    /// Time at which step 0 was due.
    started: Option<Duration>,
    next_step: u64,
    running: Option<RunningSteps>,
}

/// Steps that are being decoded in the background.
struct RunningSteps {
    task: Task<Vec<(u64, Decoded)>>,
    skipped: u64,
}

impl ClipSource {
    pub(super) fn open(folder: &Path, pace: FeedPace) -> Result<Self, CameraError> {
        Ok(Self::new(Clip::open(folder)?, None, pace))
    }

    pub(super) fn of_asset(asset: ClipAsset, pace: FeedPace) -> Self {
        Self::new(asset.clip, Some(asset.images), pace)
    }

    fn new(clip: Clip, loaded: Option<Vec<Arc<[u8]>>>, pace: FeedPace) -> Self {
        Self { clip, loaded, pace, started: None, next_step: 0, running: None }
    }

    /// The image of a step, to be decoded anywhere.
    fn image(&self, step: u64) -> EncodedImage {
        let path = self.clip.step(step).0.to_owned();
        let bytes = self.loaded.as_ref().and_then(|images| images.get(self.clip.index(step)).cloned());
        EncodedImage { path, bytes }
    }

    fn receive(&self, arrival: &mut Arrival, step: u64, decoded: Decoded) {
        let exposure = self.clip.exposure(step);
        let captured = self.started.unwrap_or_default() + self.clip.step(step).1;
        match decoded.into_frame(captured, self.clip.intrinsics) {
            Ok(frame) if exposure < 1.0 => arrival.bracketed.push(SourceFrame { exposure, ..frame }),
            Ok(frame) => arrival.frame = Some(frame),
            // The next frame may be good.
            Err(error) => {
                arrival.dropped += 1;
                arrival.state = Some(FeedState::Lost(error.to_string()));
            }
        }
    }

    /// Decodes the steps up to the next frame that is shown or cannot be read.
    fn next_in_lockstep(&mut self) -> Arrival {
        let mut arrival = Arrival::default();
        while arrival.frame.is_none() && arrival.state.is_none() {
            let decoded = self.image(self.next_step).decode();
            self.receive(&mut arrival, self.next_step, decoded);
            self.next_step += 1;
        }
        arrival
    }

    /// Newest step of each exposure, in order. Even a slow game thus sees normal frames beside the short ones.
    fn newest_of_each(&self, steps: RangeInclusive<u64>) -> Vec<u64> {
        let mut newest: Vec<u64> = Vec::new();
        for step in steps.rev().take(self.clip.files.len()) {
            if newest.iter().all(|newer| self.clip.exposure(*newer) != self.clip.exposure(step)) {
                newest.push(step);
            }
        }
        newest.reverse();
        newest
    }
}

impl FrameSource for ClipSource {
    fn tracking(&self) -> Option<&serde_json::Value> {
        self.clip.tracking.as_ref()
    }

    fn poll(&mut self, now: Duration) -> Arrival {
        if self.pace == FeedPace::Lockstep {
            return self.next_in_lockstep();
        }
        let mut arrival = Arrival::default();
        if let Some(running) = &mut self.running {
            let Some(decoded) = check_ready(&mut running.task) else {
                return arrival;
            };
            arrival.dropped = running.skipped;
            self.running = None;
            for (step, decoded) in decoded {
                self.receive(&mut arrival, step, decoded);
            }
        }
        let started = *self.started.get_or_insert(now);
        let newest_step = self.clip.step_at(now.saturating_sub(started));
        if newest_step >= self.next_step {
            let due = self.next_step..=newest_step;
            let shown = due.clone().filter(|step| self.clip.exposure(*step) == 1.0).count() as u64;
            let images: Vec<_> = self.newest_of_each(due).into_iter().map(|step| (step, self.image(step))).collect();
            let decode = async move { images.into_iter().map(|(step, image)| (step, image.decode())).collect() };
            self.running = Some(RunningSteps { task: spawn_for_frame(decode), skipped: shown.saturating_sub(1) });
            self.next_step = newest_step + 1;
        }
        arrival
    }
}
