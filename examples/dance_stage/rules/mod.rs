//! How a dance is judged: which arrow a step hits and how well, what it counts, and when the song is where.
//!
//! Steps with their times enter, verdicts and a tally leave. Times are seconds of the song's audio, as a [`SongClock`]
//! gives them. Nothing here draws, sounds, or reads a device, and equal steps always give equal verdicts, whatever the
//! frame rate.
//!
//! For each frame, in this order, for each step in the order of their times: [`Judge::advance`] to its time, then
//! [`Judge::press`] or [`Judge::release`]; at last [`Judge::advance`] to the time of the frame.
//!
//! Windows, weights and life are those of StepMania 5.1 (`Player.cpp`, `Themes/_fallback/metrics.ini`; StepMania team
//! 2001–2022).

mod audio_offset;
mod click_track;
mod demo_player;
mod judge;
mod latency_calibration;
mod song_clock;
mod tally;
mod windows;

pub(crate) use click_track::click_track;
pub(crate) use demo_player::{DemoPlayer, Step, StepKind};
pub(crate) use judge::{Judge, JudgeEvent, JudgeEventKind, Verdict};
pub(crate) use latency_calibration::{CalibrationError, LatencyCalibration};
pub(crate) use song_clock::SongClock;
pub(crate) use tally::{LetterGrade, Tally};
pub(crate) use windows::{Grade, HoldGrade, TimingWindows};
