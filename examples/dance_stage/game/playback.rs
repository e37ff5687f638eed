//! What is danced to, and where in the song the players are.

use super::calibration::Calibration;
use crate::{
    rules::SongClock,
    song::{Simfile, Timing},
};
use bevy::prelude::*;
use std::path::PathBuf;

/// The song with its charts.
#[derive(Resource)]
pub(crate) struct Song {
    pub file: Simfile,
    /// Folder of the StepMania file, in which the music is.
    pub folder: PathBuf,
}

impl Song {
    /// The file with the music. `None` if the song is silent.
    pub(crate) fn music(&self) -> Option<PathBuf> {
        (!self.file.music.is_empty()).then(|| self.folder.join(&self.file.music))
    }

    pub(crate) fn timing(&self) -> &Timing {
        &self.file.timing
    }
}

/// Progress of a dance. Times are seconds of the song's audio, negative before it begins.
#[derive(Resource)]
pub(crate) struct Playback {
    clock: SongClock,
    /// Time at the frame before.
    pub before: f64,
    /// Time at this frame.
    pub now: f64,
    /// The beat at `now`.
    pub beat: f64,
    /// Position of the audio that is heard. `None` without sound.
    pub heard: Option<f64>,
}

impl Playback {
    pub(crate) fn starting_at(seconds: f64, timing: &Timing) -> Self {
        let clock = SongClock::starting_at(seconds);
        Self { clock, before: seconds, now: seconds, beat: timing.beat_at(seconds), heard: None }
    }

    fn advance(&mut self, wall_seconds: f64, timing: &Timing) {
        self.before = self.now;
        self.now = self.clock.advance(wall_seconds, self.heard);
        self.beat = timing.beat_at(self.now);
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.clock.is_paused()
    }

    pub(crate) fn set_paused(&mut self, is_paused: bool) {
        self.clock.set_paused(is_paused);
    }
}

pub(super) fn advance_clock(time: Res<Time>, song: Res<Song>, mut playback: ResMut<Playback>) {
    playback.advance(time.delta_secs_f64(), song.timing());
}

pub(super) fn advance_metronome(time: Res<Time>, calibration: Res<Calibration>, mut playback: ResMut<Playback>) {
    playback.advance(time.delta_secs_f64(), calibration.timing());
}
