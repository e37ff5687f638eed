//! Measures the delay of sound and input together, from steps to a metronome.
//!
//! As in StepMania (`AdjustSync.cpp`), 24 steps are taken, and their mean error counts if they are even enough: a
//! standard deviation below 30 ms. Steps far from the others, such as a first one out of the blue, are left out before:
//! those farther from the median than three scaled median deviations (Leys et al. 2013), but no more than four steps.
//!
//! Errors are relative to the nearest beat, so that the delay has to be less than half a beat.

use std::f64::consts::{PI, TAU};

/// Ratio of standard deviation and median deviation of normal numbers.
const DEVIATION_SCALE: f64 = 1.4826;
const OUTLIER_DEVIATIONS: f64 = 3.0;
/// What a step may be off without being an outlier, in seconds: even steps have a median deviation of about 0.
const MIN_OUTLIER_SECONDS: f64 = 0.03;
const MAX_OUTLIERS: usize = 4;

/// Why steps give no delay.
#[derive(thiserror::Error, Clone, Copy, Debug, PartialEq)]
pub(crate) enum CalibrationError {
    #[error("the metronome has a beat of {0} seconds; take one above 0, such as 0.5")]
    Beat(f64),
    #[error(
        "the steps are uneven: their standard deviation is {:.0} ms, and has to be below {:.0} ms; step once on each \
         beat",
        spread_seconds * 1000.0,
        LatencyCalibration::MAX_SPREAD_SECONDS * 1000.0
    )]
    Uneven { spread_seconds: f64 },
}

/// Steps to a metronome whose beats are at multiples of a time.
#[derive(Clone, Debug)]
pub(crate) struct LatencyCalibration {
    beat_seconds: f64,
    /// Phase of each step after the last beat, in radians.
    phases: Vec<f64>,
}

impl LatencyCalibration {
    pub(crate) const STEPS: usize = 24;
    pub(crate) const MAX_SPREAD_SECONDS: f64 = 0.03;

    pub(crate) fn new(beat_seconds: f64) -> Result<Self, CalibrationError> {
        if beat_seconds.is_finite() && beat_seconds > 0.0 {
            Ok(Self { beat_seconds, phases: Vec::with_capacity(Self::STEPS) })
        } else {
            Err(CalibrationError::Beat(beat_seconds))
        }
    }

    /// Number of steps that are still to come.
    pub(crate) fn steps_left(&self) -> usize {
        Self::STEPS - self.phases.len()
    }

    /// Takes a step. With the last one it returns by how many seconds steps are late, negative for early, or why that
    /// is unknown, and begins anew. The time of a step less this delay is when the player meant it.
    pub(crate) fn step(&mut self, seconds: f64) -> Option<Result<f64, CalibrationError>> {
        if seconds.is_finite() {
            self.phases.push((seconds / self.beat_seconds).fract() * TAU);
        }
        (self.phases.len() >= Self::STEPS).then(|| {
            let result = self.delay_seconds();
            self.phases.clear();
            result
        })
    }

    fn delay_seconds(&self) -> Result<f64, CalibrationError> {
        // Phases are cut opposite to their mean, so that steps about halfway between beats stay together.
        let (sines, cosines) = self.phases.iter().fold((0.0, 0.0), |(y, x), phase| (y + phase.sin(), x + phase.cos()));
        let center = f64::atan2(sines, cosines);
        let seconds = |phase: f64| phase * self.beat_seconds / TAU;
        let mut errors: Vec<f64> =
            self.phases.iter().map(|phase| seconds((phase - center + PI).rem_euclid(TAU) - PI + center)).collect();
        let middle = median(&mut errors);
        errors.sort_by(|a, b| (a - middle).abs().total_cmp(&(b - middle).abs()));
        let mut deviations: Vec<f64> = errors.iter().map(|error| (error - middle).abs()).collect();
        let widest = (OUTLIER_DEVIATIONS * DEVIATION_SCALE * median(&mut deviations)).max(MIN_OUTLIER_SECONDS);
        let even = deviations.iter().filter(|deviation| **deviation <= widest).count();
        errors.truncate(even.max(Self::STEPS - MAX_OUTLIERS));

        let count = errors.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let spread_seconds = (errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / count).sqrt();
        if spread_seconds < Self::MAX_SPREAD_SECONDS {
            Ok(mean)
        } else {
            Err(CalibrationError::Uneven { spread_seconds })
        }
    }
}

/// Returns the median, and sorts the numbers. 0 if there are none.
fn median(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let middle = numbers.len() / 2;
    match (numbers.get(middle.wrapping_sub(1)), numbers.get(middle)) {
        (Some(low), Some(high)) if numbers.len().is_multiple_of(2) => 0.5 * (low + high),
        (_, Some(middle)) => *middle,
        _ => 0.0,
    }
}
