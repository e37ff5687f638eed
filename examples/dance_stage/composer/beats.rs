//! Beats: the moments that a listener taps to.
//!
//! Onset strength and beat periods enter, and the frames of the beats leave. Of all sequences of frames about a period
//! apart, it is the one that meets the most onset strength (dynamic programming after Ellis 2007).

use super::{onsets::OnsetStrength, spectrum::Spectra, tempo::Periods};

/// How much an uneven beat costs, against onset strength: a beat 10 % off costs 0.9 strong onsets.
const TIGHTNESS: f64 = 100.0;
/// Shortest and longest distance between beats, as fractions of the period.
const DISTANCES: [f64; 2] = [0.7, 1.4];

/// Frames of the beats, in order.
pub(crate) fn beat_frames(strength: &OnsetStrength, spectra: &Spectra, periods: &Periods) -> Vec<usize> {
    let worth = strength.of_beats();
    let mut total: Vec<f64> = Vec::with_capacity(worth.len());
    let mut origins: Vec<Option<usize>> = Vec::with_capacity(worth.len());
    for (frame, worth) in worth.iter().enumerate() {
        let near = periods.near(spectra.seconds(frame as f64)).map(|period| period / spectra.hop_seconds);
        let nearest = DISTANCES[0] * near.into_iter().fold(f64::INFINITY, f64::min);
        let farthest = DISTANCES[1] * near.into_iter().fold(0.0, f64::max);
        let logarithms = near.map(f64::ln);
        let best = (frame.saturating_sub(farthest as usize)..(frame + 1).saturating_sub(nearest as usize))
            .map(|before| {
                let distance = ((frame - before) as f64).ln();
                let uneven = logarithms.iter().map(|period| (distance - period).abs()).fold(f64::INFINITY, f64::min);
                (before, total[before] - TIGHTNESS * uneven * uneven)
            })
            .max_by(|a, b| a.1.total_cmp(&b.1))
            // A sequence begins where nothing before it is worth going on from.
            .filter(|(_, best)| *best > 0.0);
        total.push(f64::from(*worth) + best.map_or(0.0, |(_, best)| best));
        origins.push(best.map(|(before, _)| before));
    }
    let last = (0..total.len()).max_by(|a, b| total[*a].total_cmp(&total[*b]));
    let mut beats: Vec<usize> = std::iter::successors(last, |frame| origins[*frame]).collect();
    beats.reverse();
    beats
}
