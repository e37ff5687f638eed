//! What was sensed in a feed, compared with the truth.

use super::{
    feed::Sensed,
    hands::{Tap, hidden_fraction},
    sheet_view::SheetView,
};

/// Fraction of a field by area that a tap has to hide at least in order to count as one.
const MIN_HIDDEN: f32 = 0.12;
/// Fraction that is hidden at the true time of a step.
const CROSSING: f32 = 0.1;
/// Fraction hidden by any hand from which a press is not invented.
const GRAZING: f32 = 0.05;
/// Distance in seconds up to which a step belongs to a tap.
const NEAR: f64 = 0.1;

/// Steps that were found, missed and invented, and the errors of their times.
#[derive(Debug, Default)]
pub(super) struct Score {
    pub(super) taps: usize,
    pub(super) found: usize,
    pub(super) invented: usize,
    /// Times of steps minus the times at which taps crossed the threshold, in seconds.
    pub(super) errors: Vec<f64>,
    /// What went wrong: time, field, found or not.
    pub(super) faults: Vec<(f64, usize, &'static str)>,
}

impl Score {
    /// Compares presses with taps.
    pub(super) fn of(view: &SheetView, taps: &[Tap], sensed: &[Sensed]) -> Self {
        let mut score = Self::default();
        let mut presses: Vec<(usize, f64, f64)> = Vec::new();
        for frame in sensed {
            for (field, change) in frame.changes.iter().enumerate() {
                if let Some(change) = change.filter(|change| change.is_covered) {
                    presses.push((field, change.at_seconds, frame.seconds));
                }
            }
        }
        for tap in taps {
            let steps = ((tap.end() - tap.begin) * 1000.0) as usize;
            let time = |ms: usize| tap.begin + 0.001 * ms as f64;
            let crossing = (0..steps).map(time).find(|&at| tap.hidden(view, at) >= CROSSING);
            let most = tap.hidden(view, tap.begin + tap.down + 0.01);
            let at = crossing.unwrap_or(tap.begin + tap.down);
            let near = presses.iter().position(|&(field, press, _)| field == tap.field && (press - at).abs() < NEAR);
            let counts = most >= MIN_HIDDEN;
            score.taps += usize::from(counts);
            if let Some(near) = near {
                let (_, press, _) = presses.swap_remove(near);
                if counts {
                    score.found += 1;
                    score.errors.push(press - at);
                }
            } else if counts {
                score.faults.push((at, tap.field, "missed"));
            }
        }
        // A hand may hide fields that it does not tap on.
        presses.retain(|&(field, _, seen)| {
            let mut capsules = Vec::new();
            for tap in taps {
                tap.capsules(seen, &mut capsules);
            }
            hidden_fraction(field, view, &capsules) < GRAZING
        });
        score.invented = presses.len();
        score.faults.extend(presses.iter().map(|&(field, at, _)| (at, field, "invented")));
        score
    }

    pub(super) fn found_fraction(&self) -> f64 {
        self.found as f64 / self.taps.max(1) as f64
    }
}

/// Mean, standard deviation and largest deviation from the mean.
pub(super) fn spread(values: &[f64]) -> (f64, f64, f64) {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    let worst = values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    (mean, variance.sqrt(), worst)
}
