//! Whether a song has a beat: how much of what sounds begins on it, or at the same parts of it.

use super::{onsets::Onset, tempo_map::TempoMap};

/// Least [`clarity`] of music. Noise and sounds at random have below 0.2, because the beats are where most of them
/// happen to be; music has 0.3 to 1.
pub(crate) const MIN_CLARITY: f64 = 0.25;
/// An onset this near to a part of a beat in seconds is on it.
const REACH: f64 = 0.020;
/// Music divides beats into halves, or into thirds if it swings.
const PARTS: [f64; 2] = [2.0, 3.0];

/// Fraction of the onsets that are on halves or thirds of beats, weighted by strength and less what chance puts
/// there: 0 for onsets at random, 1 if all are.
pub(crate) fn clarity(map: &TempoMap, onsets: &[Onset]) -> f64 {
    PARTS.into_iter().map(|parts| fraction_on(map, onsets, parts)).fold(0.0, f64::max)
}

fn fraction_on(map: &TempoMap, onsets: &[Onset], parts: f64) -> f64 {
    let (mut on_beat, mut by_chance, mut all) = (0.0, 0.0, 0.0);
    for onset in onsets {
        let weight = f64::from(onset.strength.min(1.0) + onset.bass.min(1.0));
        let part = (parts * map.beat_at(onset.seconds)).round() / parts;
        let seconds = map.seconds_at(part);
        let distance = map.seconds_at(part + 1.0 / parts) - seconds;
        all += weight;
        by_chance += weight * (2.0 * REACH / distance).min(1.0);
        if (onset.seconds - seconds).abs() < REACH {
            on_beat += weight;
        }
    }
    if by_chance < all { (on_beat - by_chance) / (all - by_chance) } else { 0.0 }
}
