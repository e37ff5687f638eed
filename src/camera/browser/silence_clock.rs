//! How long a running camera has been silent.

use std::time::Duration;

/// Longest time without a frame before a camera counts as lost.
const MAX_SILENCE: Duration = Duration::from_secs(2);
/// Longest time until the first frame; slow phones need some seconds.
const MAX_OPENING_TIME: Duration = Duration::from_secs(5);
/// Longest time between two looks that counts in full. Pages in the background sleep, and their cameras with them.
const MAX_STEP: Duration = Duration::from_millis(250);

/// Counts the time without a frame while the page is awake.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SilenceClock {
    looked_at: Option<Duration>,
    silent: Duration,
    has_frames: bool,
}

impl SilenceClock {
    /// Notes that a frame has arrived.
    pub(super) fn frame_arrived(&mut self) {
        self.silent = Duration::ZERO;
        self.has_frames = true;
    }

    /// The time without a frame that was too long, if it was at the last look.
    pub(super) fn exceeded(&self) -> Option<Duration> {
        let limit = if self.has_frames { MAX_SILENCE } else { MAX_OPENING_TIME };
        (self.silent > limit).then_some(limit)
    }

    /// Looks at the clock, and returns the time without a frame. To be called in each update; `now` is any clock that
    /// does not go back.
    pub(super) fn look(&mut self, now: Duration) -> Duration {
        let step = self.looked_at.replace(now).map_or(Duration::ZERO, |last| now.saturating_sub(last));
        self.silent += step.min(MAX_STEP);
        self.silent
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_counts_while_the_page_is_awake_and_ends_with_a_frame() {
        let mut clock = SilenceClock::default();
        let at = Duration::from_millis;
        assert_eq!(clock.look(at(5000)), Duration::ZERO);
        for i in 1..=10 {
            clock.look(at(5000 + 100 * i));
        }
        assert_eq!(clock.look(at(6000)), at(1000));
        assert_eq!(clock.look(at(3_600_000)), at(1250), "an hour asleep");
        assert_eq!(clock.look(at(0)), at(1250), "a clock that goes back");
        clock.frame_arrived();
        assert_eq!(clock.look(at(100)), at(100));
    }

    #[test]
    fn silence_is_too_long_after_two_seconds_and_before_the_first_frame_after_five() {
        let mut clock = SilenceClock::default();
        for limit in [MAX_OPENING_TIME, MAX_SILENCE] {
            let looks = (0..100).map(|i| Duration::from_millis(100 * i));
            let exceeded = looks.map(|now| (now, clock.look(now), clock.exceeded()));
            let first = exceeded.into_iter().find(|(_, _, exceeded)| exceeded.is_some());
            assert!(first.is_some_and(|(now, silent, exceeded)| exceeded == Some(limit) && now == silent), "{first:?}");
            clock = SilenceClock::default();
            clock.frame_arrived();
        }
    }
}
