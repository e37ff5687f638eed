//! The newest frame, which waits for the game.

use glam::UVec2;
use std::time::Duration;

/// A frame of the browser's camera.
pub(crate) struct Captured {
    /// Width and height in pixels.
    pub(crate) size: UVec2,
    /// `4 · width · height` bytes: red, green, blue, alpha; sRGB-encoded; rows from top to bottom. Alpha is 255.
    pub(crate) rgba: Vec<u8>,
    /// Time since the capture, or since the arrival in browsers that do not tell the capture.
    pub(crate) age: Duration,
    /// Time that reading the pixels took.
    pub(crate) read_time: Duration,
    /// Number of frames since the last one that the game never sees.
    pub(crate) dropped: u64,
}

/// A frame as it was read.
pub(super) struct ReadFrame {
    pub(super) size: UVec2,
    /// `4 · width · height` bytes.
    pub(super) rgba: Vec<u8>,
    /// Time of capture on the page's clock, `performance.now()`.
    pub(super) captured: Duration,
    pub(super) read_time: Duration,
}

/// Holds the newest frame and counts those that the game never sees.
#[derive(Default)]
pub(super) struct NewestFrame {
    frame: Option<ReadFrame>,
    dropped: u64,
    /// Number of the newest frame that the browser has shown.
    presented: Option<u32>,
}

impl NewestFrame {
    /// Replaces the frame that waits. A frame that is older than it, because reading it took longer, is dropped.
    pub(super) fn put(&mut self, frame: ReadFrame) {
        match &self.frame {
            Some(waiting) if waiting.captured > frame.captured => self.dropped += 1,
            _ => self.dropped += u64::from(self.frame.replace(frame).is_some()),
        }
    }

    /// Counts a frame that could not be read.
    pub(super) fn drop_one(&mut self) {
        self.dropped += 1;
    }

    /// Counts the frames between the last one and this one, by the browser's own number.
    pub(super) fn note_presented(&mut self, number: u32) {
        let missed = self.presented.replace(number).map_or(0, |last| number.saturating_sub(last).saturating_sub(1));
        self.dropped += u64::from(missed);
    }

    /// Takes the frame that waits. `now` is the page's clock.
    pub(super) fn take(&mut self, now: Duration) -> Option<Captured> {
        let ReadFrame { size, rgba, captured, read_time } = self.frame.take()?;
        let dropped = std::mem::take(&mut self.dropped);
        Some(Captured { size, rgba, age: now.saturating_sub(captured), read_time, dropped })
    }
}

/// Longest plausible time between the capture of a frame and its presentation.
const MAX_LATENCY_MS: f64 = 1000.0;
/// How much later than now a time may seem to be: browsers round their clocks.
const MAX_ROUNDING_MS: f64 = 5.0;

/// The time of capture of a frame on the page's clock, in milliseconds: the camera's own if the browser tells it and it
/// is plausible, else that of its arrival on the screen, and never later than `now`.
pub(super) fn capture_time(now: f64, capture: Option<f64>, presentation: Option<f64>) -> f64 {
    let is_plausible = |time: &f64| (now - MAX_LATENCY_MS..=now + MAX_ROUNDING_MS).contains(time);
    capture.filter(is_plausible).or(presentation.filter(is_plausible)).unwrap_or(now).min(now)
}

/// A time of the page's clock. Zero for what is none.
pub(super) fn page_time(milliseconds: f64) -> Duration {
    Duration::try_from_secs_f64(milliseconds / 1000.0).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(value: u8, captured: u64) -> ReadFrame {
        let captured = Duration::from_millis(captured);
        ReadFrame { size: UVec2::ONE, rgba: vec![value; 4], captured, read_time: Duration::ZERO }
    }

    #[test]
    fn the_newest_frame_wins_and_the_others_are_counted() {
        let mut newest = NewestFrame::default();
        newest.put(frame(1, 10));
        newest.put(frame(2, 20));
        newest.drop_one();
        newest.put(frame(3, 15));
        let taken = newest.take(Duration::from_millis(50)).expect("two were put");
        assert_eq!((taken.rgba[0], taken.dropped, taken.age), (2, 3, Duration::from_millis(30)));
        assert_eq!((taken.size, taken.read_time), (UVec2::ONE, Duration::ZERO));
        assert!(newest.take(Duration::ZERO).is_none());
        newest.put(frame(4, 60));
        let early = newest.take(Duration::ZERO).expect("was put");
        assert_eq!((early.dropped, early.age), (0, Duration::ZERO));
    }

    #[test]
    fn frames_that_the_browser_skipped_count_as_dropped() {
        let mut newest = NewestFrame::default();
        for number in [7, 8, 11, 2, 3] {
            newest.note_presented(number);
        }
        newest.put(frame(0, 0));
        assert_eq!(newest.take(Duration::ZERO).map(|taken| taken.dropped), Some(2), "9 and 10; 2 begins a new count");
    }

    #[test]
    fn implausible_times_of_capture_are_replaced() {
        assert_eq!(capture_time(5000.0, Some(4990.0), Some(4995.0)), 4990.0);
        assert_eq!(capture_time(5000.0, None, Some(4995.0)), 4995.0);
        assert_eq!(capture_time(5000.0, Some(5001.0), None), 5000.0);
        for odd in [0.0, 5006.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(capture_time(5000.0, Some(odd), Some(4995.0)), 4995.0, "{odd}");
            assert_eq!(capture_time(5000.0, Some(odd), Some(odd)), 5000.0, "{odd}");
        }
        for odd in [f64::NAN, -3.0, f64::INFINITY] {
            assert_eq!(page_time(odd), Duration::ZERO, "{odd}");
        }
    }
}
