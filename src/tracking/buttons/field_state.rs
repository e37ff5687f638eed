//! State of one field over time: pressed while it is covered.
//!
//! The coverage of each frame and its time of capture enter; a change leaves in the frame that shows it first, with the
//! time between the two frames at which coverage crossed the threshold. Seconds of any clock that does not go back.
//! Where a frame cannot tell, the state is held.

/// Coverage from which a field is pressed.
const PRESS_COVERAGE: f32 = 0.07;
/// Coverage below which it is released.
const RELEASE_COVERAGE: f32 = 0.045;
/// Longest time before a frame in which a change may have happened, in seconds. After a longer gap, when it happened is
/// not known.
const MAX_GAP_SECONDS: f64 = 0.1;

/// A press or a release.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    /// Pressed (`true`) or released.
    pub is_covered: bool,
    /// When coverage crossed the threshold, on the clock of the times of capture.
    pub at_seconds: f64,
}

/// Whether a field is covered, since the first frame that could tell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FieldState {
    is_covered: Option<bool>,
    /// Coverage and time of capture of the last frame that could tell.
    last: Option<(f32, f64)>,
}

impl FieldState {
    /// Takes the coverage in the next frame: `None` where the frame cannot tell. A field that is covered in the first
    /// frame that can tell is covered without a change.
    pub(super) fn update(&mut self, coverage: Option<f32>, captured_seconds: f64) -> Option<Change> {
        let coverage = coverage.filter(|coverage| coverage.is_finite())?;
        let before = self.last.replace((coverage, captured_seconds));
        let was_covered = self.is_covered;
        let threshold = if was_covered == Some(true) { RELEASE_COVERAGE } else { PRESS_COVERAGE };
        let is_covered = coverage >= threshold;
        self.is_covered = Some(is_covered);
        let (coverage_before, seconds_before) = before?;
        if was_covered? == is_covered {
            return None;
        }
        let elapsed = (captured_seconds - seconds_before).clamp(0.0, MAX_GAP_SECONDS);
        // Coverage was on the other side of the threshold before, so the difference is not 0.
        let after_crossing = (coverage - threshold) / (coverage - coverage_before);
        let at_seconds = captured_seconds - elapsed * f64::from(after_crossing.clamp(0.0, 1.0));
        Some(Change { is_covered, at_seconds })
    }

    /// Whether the field is covered: `None` until a frame could tell.
    pub(super) fn is_covered(&self) -> Option<bool> {
        self.is_covered
    }

    /// Coverage in the last frame that could tell, 0…1.
    pub(super) fn coverage(&self) -> Option<f32> {
        self.last.map(|(coverage, _)| coverage)
    }
}
