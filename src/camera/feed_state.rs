//! State and statistics of camera feeds.

use bevy::prelude::*;
use std::time::Duration;

/// How a feed is doing.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub enum FeedState {
    /// No picture has arrived yet.
    #[default]
    Waiting,
    /// Pictures arrive.
    Playing,
    /// Pictures have stopped for the moment; the text says why. The last good picture stays, and the feed goes on by itself when
    /// it can.
    Lost(String),
    /// The source cannot be used; the text says why and what to do. The last good picture stays. Insert a new
    /// [`CameraFeed`] to try again.
    Failed(String),
}

/// Figures of a feed since its [`CameraFeed`] was added to the entity.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct FeedStatistics {
    /// Pictures taken in, those of a shorter exposure aside.
    pub frames: u64,
    /// Pictures of a shorter exposure taken in. They are neither shown nor counted as dropped when they are replaced.
    pub bracketed: u64,
    /// Pictures the source had and the game never saw: replaced by newer ones, or damaged.
    pub dropped: u64,
    /// Pictures per second that the source delivers at its usual exposure, dropped ones included, smoothed. 0 until two have arrived.
    pub capture_rate: f32,
    /// Time the decoding of the newest picture took, in the background.
    pub decode_time: Duration,
    pub(super) last_captured: Option<Duration>,
}

/// Weight of the newest picture in the smoothed capture rate.
const RATE_SMOOTHING: f32 = 0.1;

impl FeedStatistics {
    /// Counts `dropped` pictures and then one that was taken in.
    pub(super) fn note_frame(&mut self, dropped: u64, captured: Duration, decode_time: Duration) {
        self.frames += 1;
        self.decode_time = decode_time;
        let elapsed = self.last_captured.replace(captured).map(|last| captured.saturating_sub(last).as_secs_f32());
        if let Some(elapsed) = elapsed.filter(|elapsed| *elapsed > 0.0) {
            let rate = (1 + dropped) as f32 / elapsed;
            let weight = if self.capture_rate > 0.0 { RATE_SMOOTHING } else { 1.0 };
            self.capture_rate += weight * (rate - self.capture_rate);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_capture_rate_counts_dropped_frames_too() {
        let mut statistics = FeedStatistics::default();
        let at = Duration::from_millis;
        statistics.note_frame(0, at(0), at(1));
        assert_eq!(statistics.capture_rate, 0.0, "one frame has no rate");
        for i in 1..100 {
            statistics.note_frame(1, at(100 * i), at(1));
        }
        assert!((statistics.capture_rate - 20.0).abs() < 1e-3, "{statistics:?}");
        assert_eq!(statistics.frames, 100);
    }
}
