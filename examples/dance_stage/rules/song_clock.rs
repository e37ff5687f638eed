//! The clock of a song: what is heard now, in seconds of its audio.
//!
//! Time of the wall clock and positions of the audio enter once a frame, the time of the song leaves. Without audio the
//! wall clock alone drives it. With audio it runs smoothly with the wall clock and is drawn to what is heard:
//! - It never runs backwards, and it does not jump as long as it is less than half a second off.
//! - It is within a few milliseconds of what is heard after some seconds, and again half a second after a stall.
//! - It stands still if the audio does for longer than positions usually take to change.
//! - It jumps to audio that was moved by half a second or more.
//!
//! The delay between a position and the moment when it is heard is the device's, and no program sees it:
//! [`LatencyCalibration`](super::LatencyCalibration) measures it.

use super::audio_offset::AudioOffset;

/// Error from which on the clock jumps.
const JUMP_SECONDS: f64 = 0.5;
/// Time after which an error has shrunk to 1/e.
const PULL_SECONDS: f64 = 0.08;
/// Fastest rate at which the clock catches up, in seconds per second.
const MAX_RATE: f64 = 3.0;
/// Longest time without a new position in which the clock goes on. Blocks of audio devices are shorter.
const MAX_COAST_SECONDS: f64 = 0.1;
/// Longest frame that is believed. After a longer one, as of a computer that slept, the audio says where the song is.
const MAX_FRAME_SECONDS: f64 = 60.0;

/// Clock of a song.
#[derive(Clone, Debug)]
pub(crate) struct SongClock {
    song_seconds: f64,
    /// Time of the wall clock while the song was not paused.
    wall_seconds: f64,
    audio: AudioOffset,
    /// When the last new position of the audio came.
    fresh_seconds: f64,
    is_paused: bool,
}

impl SongClock {
    /// Makes a clock that starts at a time of the song, negative for a lead-in without audio.
    pub(crate) fn starting_at(song_seconds: f64) -> Self {
        Self { song_seconds, wall_seconds: 0.0, audio: AudioOffset::new(), fresh_seconds: 0.0, is_paused: false }
    }

    pub(crate) fn seconds(&self) -> f64 {
        self.song_seconds
    }

    pub(crate) fn is_paused(&self) -> bool {
        self.is_paused
    }

    /// Lets the song stand still or go on. The audio has to do the same.
    pub(crate) fn set_paused(&mut self, is_paused: bool) {
        self.is_paused = is_paused;
    }

    /// Advances by the time since the last frame, with the position of the audio now if there is audio. Returns the
    /// time of the song. What is not finite, and wall clocks that run backwards, count as no time and no audio.
    pub(crate) fn advance(&mut self, wall_delta_seconds: f64, audio_position: Option<f64>) -> f64 {
        if self.is_paused {
            return self.song_seconds;
        }
        let is_time = wall_delta_seconds.is_finite();
        let delta = if is_time { wall_delta_seconds.clamp(0.0, MAX_FRAME_SECONDS) } else { 0.0 };
        self.wall_seconds += delta;
        match audio_position.filter(|position| position.is_finite()) {
            Some(position) => self.follow(delta, position),
            None => {
                self.song_seconds += delta;
                self.fresh_seconds = self.wall_seconds;
            }
        }
        self.song_seconds
    }

    fn follow(&mut self, delta: f64, position: f64) {
        if self.audio.read(self.wall_seconds, position) {
            self.fresh_seconds = self.wall_seconds;
        }
        if self.wall_seconds - self.fresh_seconds > MAX_COAST_SECONDS {
            return;
        }
        let Some(heard) = self.audio.position_at(self.wall_seconds) else {
            self.song_seconds += delta;
            return;
        };
        // What the wall clock alone would make of it.
        let error = heard - (self.song_seconds + delta);
        if error.abs() >= JUMP_SECONDS {
            self.song_seconds = heard;
        } else {
            let pull = error * (1.0 - (-delta / PULL_SECONDS).exp());
            self.song_seconds += (delta + pull).clamp(0.0, MAX_RATE * delta);
        }
    }
}
