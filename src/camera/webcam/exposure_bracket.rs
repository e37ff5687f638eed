//! Exposure bracketing of a webcam: when the exposure changes, and which frames are certain to have the requested one.
//!
//! Cameras do not report the exposure of a frame. Frames that are in the camera or in transfer when the exposure is
//! changed have the old one. USB cameras apply a change one to three frames late, and a frame in between may mix both
//! exposures. Therefore the first frames after each change are discarded.

use std::time::{Duration, Instant};

/// Number of frames discarded after a change: one that is in transfer, and three by which a camera may be late.
const UNCERTAIN_FRAMES: u32 = 4;
/// Time between two rounds, during which all frames are shown. A round with one shorter exposure costs nine frames.
const ROUND_INTERVAL: Duration = Duration::from_secs(2);

/// A camera's position in the rounds through its exposures.
pub(super) struct ExposureBracket {
    /// Relative exposure of each step; the first one is the usual exposure, 1.
    steps: Vec<f32>,
    step: usize,
    uncertain_frames: u32,
    next_round: Instant,
}

impl ExposureBracket {
    /// Starts with a camera that has just been set to the usual exposure, 1. `shorter` has its other exposures, as
    /// fractions of the usual one.
    pub(super) fn new(shorter: &[f32], now: Instant) -> Self {
        let steps: Vec<f32> = std::iter::once(1.0).chain(shorter.iter().copied()).collect();
        let uncertain_frames = if shorter.is_empty() { 0 } else { UNCERTAIN_FRAMES };
        Self { steps, step: 0, uncertain_frames, next_round: now + ROUND_INTERVAL }
    }

    /// Counts a frame that has arrived and returns its exposure; `None` if that is uncertain.
    pub(super) fn arrived(&mut self) -> Option<f32> {
        if self.uncertain_frames > 0 {
            self.uncertain_frames -= 1;
            return None;
        }
        Some(self.steps[self.step])
    }

    /// Returns the step to which the exposure has to be changed now, after an intact frame of a certain exposure.
    /// Frames that arrive from now on count as later than the change: the caller has to drop those that are already in
    /// the queue.
    pub(super) fn next(&mut self, now: Instant) -> Option<usize> {
        let is_due = self.steps.len() > 1 && (self.step > 0 || now >= self.next_round);
        is_due.then(|| {
            self.step = (self.step + 1) % self.steps.len();
            self.uncertain_frames = UNCERTAIN_FRAMES;
            self.next_round = now + ROUND_INTERVAL;
            self.step
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera that changes its exposure `late` frames after the frame that is in transfer.
    struct LateCamera {
        late: usize,
        /// Exposure steps of the next frames.
        coming: Vec<usize>,
        is_mixed: Vec<bool>,
    }

    impl LateCamera {
        fn new(late: usize) -> Self {
            Self { late, coming: vec![0; 10], is_mixed: vec![false; 10] }
        }

        fn set(&mut self, step: usize) {
            self.coming[1 + self.late..].fill(step);
            self.is_mixed[self.late] = true;
        }

        fn take(&mut self) -> (usize, bool) {
            let last = self.coming[self.coming.len() - 1];
            self.coming.push(last);
            self.is_mixed.push(false);
            (self.coming.remove(0), self.is_mixed.remove(0))
        }
    }

    const BRACKETED: [f32; 2] = [0.25, 0.05];
    const INTERVAL: Duration = Duration::from_millis(33);

    #[test]
    fn every_frame_has_the_exposure_it_is_said_to_have_however_late_the_camera_is() {
        for late in 0..=3 {
            let mut camera = LateCamera::new(late);
            let start = Instant::now();
            let mut bracket = ExposureBracket::new(&BRACKETED, start);
            let (mut usual, mut shorter) = (0, Vec::new());
            for i in 0..600 {
                let (step, is_mixed) = camera.take();
                let Some(exposure) = bracket.arrived() else { continue };
                assert!(!is_mixed && exposure == [1.0, 0.25, 0.05][step], "picture {i}, {late} late");
                if step == 0 {
                    usual += 1;
                } else {
                    shorter.push(exposure);
                }
                if let Some(step) = bracket.next(start + i * INTERVAL) {
                    camera.set(step);
                }
            }
            // Twenty seconds: rounds of 2.5 seconds, two of which have the usual exposure.
            assert!((7..=8).contains(&(shorter.len() / 2)), "{shorter:?}");
            assert!(shorter.chunks(2).all(|round| round == BRACKETED || round == [0.25]));
            assert!(usual > 450, "{usual} of 600");
        }
    }

    #[test]
    fn a_damaged_frame_of_a_shorter_exposure_is_taken_again() {
        let start = Instant::now();
        let mut bracket = ExposureBracket::new(&BRACKETED, start);
        while bracket.arrived().is_none() {}
        assert_eq!(bracket.next(start), None);
        assert_eq!(bracket.next(start + ROUND_INTERVAL), Some(1));
        while bracket.arrived().is_none() {}
        // No change follows a damaged frame.
        assert_eq!(bracket.arrived(), Some(0.25));
        assert_eq!(bracket.next(start + ROUND_INTERVAL), Some(2));
    }

    #[test]
    fn a_camera_without_shorter_exposures_is_never_changed_and_loses_no_frame() {
        let start = Instant::now();
        let mut bracket = ExposureBracket::new(&[], start);
        for i in 0..200 {
            assert_eq!(bracket.arrived(), Some(1.0));
            assert_eq!(bracket.next(start + i * INTERVAL), None);
        }
    }
}
