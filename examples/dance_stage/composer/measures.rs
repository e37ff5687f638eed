//! Which beats begin measures, in music of four beats to a measure.
//!
//! Bass drums and basses are strongest on the first beat of a measure, and harmony and instruments change there.

use super::{
    onsets::{Onset, OnsetStrength},
    spectrum::Spectra,
    tempo_map::TempoMap,
};

/// Beats of a measure.
pub(crate) const BEATS_PER_MEASURE: usize = 4;
/// Bass on the third beat is a hint too, as on the first.
const HALF_MEASURE_WEIGHT: f64 = 0.5;
/// Most songs begin with a measure, not with an upbeat.
const START_WEIGHT: f64 = 1.5;
/// The song starts with an onset of at least this strength; weaker ones are noise before it.
const START_STRENGTH: f32 = 0.3;
/// Onsets up to this fraction of a beat before a beat are at it.
const EARLY_BEATS: f64 = 0.1;

/// Renumbers the beats so that beat 0 begins the measure in which the first sound is.
pub(crate) fn count_from_downbeat(
    map: &TempoMap,
    onsets: &[Onset],
    strength: &OnsetStrength,
    spectra: &Spectra,
) -> TempoMap {
    let beat_of = |onset: Option<&Onset>| onset.map_or(0.0, |onset| (map.beat_at(onset.seconds) + EARLY_BEATS).floor());
    let first_beat = beat_of(onsets.first());
    let start = beat_of(onsets.iter().find(|onset| onset.strength >= START_STRENGTH)) - first_beat;
    let start = start.rem_euclid(BEATS_PER_MEASURE as f64) as usize;
    let last_beat = map.beat_at(spectra.seconds(spectra.frames() as f64)).floor();
    let mut evidence = [[0.0; BEATS_PER_MEASURE]; 2];
    for beat in 0..(last_beat - first_beat).max(0.0) as usize {
        let at = first_beat + beat as f64;
        let place = beat % BEATS_PER_MEASURE;
        evidence[0][place] += bass_near(map.seconds_at(at), strength, spectra);
        evidence[1][place] += change_at(map, at, spectra);
    }
    let [bass, change] = evidence.map(standardized);
    let score = |place: usize| {
        let half = (place + BEATS_PER_MEASURE / 2) % BEATS_PER_MEASURE;
        let start = if place == start { START_WEIGHT } else { 0.0 };
        bass[place] + HALF_MEASURE_WEIGHT * bass[half] + change[place] + start
    };
    let downbeat = (0..BEATS_PER_MEASURE).max_by(|a, b| score(*a).total_cmp(&score(*b))).unwrap_or(0);
    let back = (BEATS_PER_MEASURE - downbeat) % BEATS_PER_MEASURE;
    map.renumbered(first_beat - back as f64)
}

/// Bass of what begins at a time, less its treble: a bass drum and not a snare.
fn bass_near(seconds: f64, strength: &OnsetStrength, spectra: &Spectra) -> f64 {
    const REACH: usize = 4;
    let frame = spectra.frame_at(seconds).max(0.0) as usize;
    let strongest = |strengths: &[f32]| {
        let near = strengths.iter().take(frame + REACH + 1).skip(frame.saturating_sub(REACH));
        f64::from(near.copied().fold(0.0, f32::max).min(1.0))
    };
    strongest(&strength.bass) - strongest(&strength.full)
}

/// How much the spectrum of two beats that begin differs from that of the two before.
fn change_at(map: &TempoMap, beat: f64, spectra: &Spectra) -> f64 {
    let before = mean_spectrum(spectra, map.seconds_at(beat - 2.0), map.seconds_at(beat));
    let after = mean_spectrum(spectra, map.seconds_at(beat), map.seconds_at(beat + 2.0));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let norms = (product(&before, &before) * product(&after, &after)).sqrt();
    if norms > 0.0 { 1.0 - product(&before, &after) / norms } else { 0.0 }
}

/// Mean magnitudes of the bands between two times.
fn mean_spectrum(spectra: &Spectra, start: f64, end: f64) -> Vec<f64> {
    let frame = |seconds: f64| (spectra.frame_at(seconds).max(0.0) as usize).min(spectra.frames());
    let mut mean = vec![0.0; spectra.centers.len()];
    for frame in frame(start)..frame(end) {
        for (mean, magnitude) in mean.iter_mut().zip(spectra.frame(frame)) {
            *mean += f64::from(*magnitude);
        }
    }
    mean
}

/// Subtracts the mean and divides by the standard deviation.
fn standardized(values: [f64; BEATS_PER_MEASURE]) -> [f64; BEATS_PER_MEASURE] {
    let mean = values.iter().sum::<f64>() / BEATS_PER_MEASURE as f64;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / BEATS_PER_MEASURE as f64;
    values.map(|value| (value - mean) / variance.sqrt().max(1e-9))
}
