//! State and statistics of camera feeds.

use bevy::prelude::*;
use std::time::Duration;

/// State of a camera feed.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::FeedState;
/// fn report(states: Query<&FeedState, Changed<FeedState>>) {
///     for state in &states {
///         if let FeedState::Lost(reason) | FeedState::Failed(reason) = state {
///             warn!("{reason}");
///         }
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum FeedState {
    /// No frame has arrived yet.
    #[default]
    Waiting,
    /// Frames arrive.
    Playing,
    /// No frames arrive at present; the text says why. The last good frame stays, and the feed resumes by itself.
    Lost(String),
    /// The source cannot be used; the text gives the reason and the remedy. The last good frame stays. Insert a new
    /// [`CameraFeed`](super::CameraFeed) to try again.
    Failed(String),
}

/// Statistics of a feed since its [`CameraFeed`](super::CameraFeed) was added to the entity.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::FeedStatistics;
/// fn report(feeds: Query<&FeedStatistics>) {
///     for feed in &feeds {
///         info!("{:.1} frames per second, {} dropped", feed.capture_rate, feed.dropped);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct FeedStatistics {
    /// Number of frames received, without bracketed ones.
    pub frames: u64,
    /// Number of frames received with a shorter exposure. They are neither shown nor counted as dropped when replaced.
    pub bracketed: u64,
    /// Number of frames that the source delivered and the game never saw, because they were damaged or newer ones
    /// replaced them.
    pub dropped: u64,
    /// Frames per second that the source delivers at its normal exposure, including dropped ones; smoothed. 0 until
    /// two frames have arrived.
    pub capture_rate: f32,
    /// Time that decoding the newest frame took in the background.
    pub decode_time: Duration,
    pub(super) last_captured: Option<Duration>,
}

/// Weight of the newest frame in the smoothed capture rate.
const RATE_SMOOTHING: f32 = 0.1;

impl FeedStatistics {
    /// Counts `dropped` frames and then one that was received.
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
