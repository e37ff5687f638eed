//! A player that dances a chart by itself, a little early or late like a person, and drops no arrow.
//!
//! A chart, its timing, a spread and a seed enter, steps with their times leave. The errors of successive steps are
//! correlated, as those of people who tap to a beat are (Repp 2005): a person who is late stays late for a while. Feet
//! of a jump land nearly together. No error is so large that a step could miss its arrow or hit another one.

use super::windows::TimingWindows;
use crate::random::Random;
use crate::song::{Lane, Note, StepChart, Timing};

/// What a foot does on a panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepKind {
    Press,
    Release,
}

/// Movement of a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// In seconds of the song.
    pub seconds: f64,
    pub lane: Lane,
    pub kind: StepKind,
}

/// Correlation of a row's error with that of the row before.
const CORRELATION: f64 = 0.5;
/// Standard deviation between the feet of a jump, as a fraction of that of the rows.
const JUMP_SPREAD: f64 = 0.2;
/// Largest error as a fraction of the widest window.
const MAX_ERROR: f64 = 0.9;
/// Largest error as a fraction of the time to the next or last arrow of the lane, less than half.
const MAX_ERROR_IN_GAP: f64 = 0.35;
/// How long a foot stays on a panel for a step, and how long after the end of a hold.
const TAP_SECONDS: f64 = 0.08;
const AFTER_HOLD_SECONDS: f64 = 0.03;
/// The same as a fraction of the time to the next arrow of the lane, so that the foot is up before the next step.
const MAX_STAY_IN_GAP: f64 = 0.2;

/// A player for demonstrations and tests.
#[derive(Clone, Debug)]
pub(crate) struct DemoPlayer {
    /// By time.
    steps: Vec<Step>,
}

impl DemoPlayer {
    /// Standard deviation in seconds of a good player, most of whose steps are Perfect or better.
    pub(crate) const GOOD_SPREAD_SECONDS: f64 = 0.018;

    /// Plans all steps of a chart. `spread_seconds` is the standard deviation of their errors, 0 for none.
    pub(crate) fn new(
        chart: &StepChart,
        timing: &Timing,
        windows: TimingWindows,
        spread_seconds: f64,
        seed: u64,
    ) -> Self {
        let notes = chart.notes();
        let due = |note: &Note| timing.seconds_at(note.beat());
        let end = |note: &Note| timing.seconds_at(note.last_row().beat());
        let spread = if spread_seconds.is_finite() { spread_seconds.max(0.0) } else { 0.0 };
        let mut random = Random::new(seed);
        let mut error = random.normal() * spread;
        let mut last_ends = [f64::NEG_INFINITY; Lane::COUNT];
        let mut steps = Vec::with_capacity(2 * notes.len());
        for (i, note) in notes.iter().enumerate() {
            if i > 0 && notes[i - 1].row != note.row {
                let innovation = (1.0 - CORRELATION * CORRELATION).sqrt();
                error = CORRELATION * error + innovation * spread * random.normal();
            }
            let own_error = error + JUMP_SPREAD * spread * random.normal();
            let next = notes[i + 1..].iter().find(|next| next.lane == note.lane).map_or(f64::INFINITY, due);
            let last_end = std::mem::replace(&mut last_ends[note.lane.index()], end(note));
            let gap = (due(note) - last_end).min(next - due(note));
            let max_error = (MAX_ERROR * windows.widest_seconds()).min(MAX_ERROR_IN_GAP * gap).max(0.0);
            let press = due(note) + own_error.clamp(-max_error, max_error);
            let release = if note.length_rows.is_some() {
                end(note).max(press) + AFTER_HOLD_SECONDS.min(MAX_STAY_IN_GAP * (next - end(note)))
            } else {
                press + TAP_SECONDS.min(MAX_STAY_IN_GAP * (next - due(note)))
            };
            steps.push(Step { seconds: press, lane: note.lane, kind: StepKind::Press });
            steps.push(Step { seconds: release, lane: note.lane, kind: StepKind::Release });
        }
        steps.sort_by(|a, b| a.seconds.total_cmp(&b.seconds).then(a.lane.cmp(&b.lane)));
        Self { steps }
    }

    /// Returns the steps after one time and until another, in their order.
    pub(crate) fn steps(&self, after_seconds: f64, until_seconds: f64) -> &[Step] {
        let count = |time: f64| self.steps.partition_point(|step| step.seconds <= time);
        let start = count(after_seconds);
        &self.steps[start..count(until_seconds).max(start)]
    }
}
