//! Onsets: when sounds begin, and how strongly.
//!
//! Spectra enter. What leaves is the onset strength of every frame, by spectral flux with a maximum filter across
//! neighboring bands, which keeps vibrato from counting (Böck and Widmer 2013, `SuperFlux`; Dixon 2006), and the onsets
//! themselves: its peaks above their surroundings, placed between the frames by a parabola.

use super::spectrum::Spectra;

/// Flux compares a frame with the one this long before, in seconds.
const FLUX_SECONDS: f64 = 0.015;
/// The flux is largest this long after a sound begins, in seconds. Measured on drums, tones and noise, which lie
/// within 3 ms of it; the test `onsets_are_where_sounds_begin` holds it to the truth.
const LATE_SECONDS: f64 = 0.0016;
/// Bass drums and basses lie below this frequency in hertz.
const BASS: f32 = 160.0;
/// An onset is the largest within this time to both sides, in seconds.
const APART_SECONDS: f64 = 0.030;
/// Surroundings that an onset is compared with, to both sides, in seconds.
const SURROUNDINGS_SECONDS: f64 = 0.4;
/// An onset is above its surroundings by this fraction of the song's strong onsets.
const THRESHOLD: f32 = 0.08;
/// Fraction of the frames that are no strong onsets.
const STRONG_QUANTILE: f64 = 0.98;

/// Largest strength that counts towards a beat, so that one crash does not outweigh its neighbors.
const MAX_BEAT: f32 = 1.0;

/// Begin of a sound.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Onset {
    /// Time in the song.
    pub seconds: f64,
    /// Strength, 1 for the strong onsets of the song.
    pub strength: f32,
    /// The same for its bass alone.
    pub bass: f32,
}

/// Onset strength of each frame, 1 for the strong onsets of the song and 0 where nothing begins.
pub(crate) struct OnsetStrength {
    pub full: Vec<f32>,
    pub bass: Vec<f32>,
}

impl OnsetStrength {
    pub(crate) fn of(spectra: &Spectra) -> Self {
        let bass_bands = spectra.centers.iter().take_while(|center| **center < BASS).count().max(1);
        let past = (FLUX_SECONDS / spectra.hop_seconds).round().max(1.0) as usize;
        let flux = |bands: std::ops::Range<usize>| -> Vec<f32> {
            (0..spectra.frames())
                .map(|frame| {
                    let Some(before) = frame.checked_sub(past) else { return 0.0 };
                    let (now, before) = (spectra.frame(frame), spectra.frame(before));
                    bands.clone().map(|band| (now[band] - loudest_neighbor(before, band)).max(0.0)).sum()
                })
                .collect()
        };
        let surroundings = (SURROUNDINGS_SECONDS / spectra.hop_seconds) as usize;
        let finish = |flux: Vec<f32>| normalized(&above_surroundings(&smooth(&flux), surroundings));
        Self { full: finish(flux(0..spectra.centers.len())), bass: finish(flux(0..bass_bands)) }
    }

    /// What beats are looked for in. Drums of few bands weigh as much as cymbals of many.
    pub(crate) fn of_beats(&self) -> Vec<f32> {
        self.full.iter().zip(&self.bass).map(|(full, bass)| full.min(MAX_BEAT) + bass.min(MAX_BEAT)).collect()
    }

    /// The onsets, in order of time.
    pub(crate) fn onsets(&self, spectra: &Spectra) -> Vec<Onset> {
        let apart = (APART_SECONDS / spectra.hop_seconds).round() as usize;
        let full = &self.full;
        (1..full.len().saturating_sub(1))
            .filter_map(|frame| {
                let strength = full[frame];
                let near = frame.saturating_sub(apart)..(frame + apart + 1).min(full.len());
                // Of equal neighbors the first counts.
                let is_peak = strength > THRESHOLD
                    && full[near.start..frame].iter().all(|other| *other < strength)
                    && full[frame..near.end].iter().all(|other| *other <= strength);
                let bass = self.bass[near].iter().copied().fold(0.0, f32::max);
                let place = frame as f64 + vertex(full[frame - 1], strength, full[frame + 1]);
                is_peak.then(|| Onset { seconds: onset_seconds(spectra, place), strength, bass })
            })
            .collect()
    }
}

/// Time at which a sound begins whose flux is largest at a frame.
pub(crate) fn onset_seconds(spectra: &Spectra, frame: f64) -> f64 {
    spectra.seconds(frame) - LATE_SECONDS
}

fn loudest_neighbor(frame: &[f32], band: usize) -> f32 {
    frame[band.saturating_sub(1)..(band + 2).min(frame.len())].iter().copied().fold(0.0, f32::max)
}

/// Place of the top of the parabola through three values, relative to the middle one.
fn vertex(before: f32, top: f32, after: f32) -> f64 {
    let curvature = before - 2.0 * top + after;
    if curvature < 0.0 { f64::from(0.5 * (before - after) / curvature).clamp(-0.5, 0.5) } else { 0.0 }
}

fn smooth(values: &[f32]) -> Vec<f32> {
    let at = |i: usize| values.get(i).copied().unwrap_or(0.0);
    (0..values.len()).map(|i| 0.25 * at(i.wrapping_sub(1)) + 0.5 * at(i) + 0.25 * at(i + 1)).collect()
}

/// Subtracts the mean of the surroundings, and leaves nothing below zero.
fn above_surroundings(values: &[f32], reach: usize) -> Vec<f32> {
    let mut sums = vec![0.0];
    sums.extend(values.iter().scan(0.0, |sum, value| {
        *sum += f64::from(*value);
        Some(*sum)
    }));
    (0..values.len())
        .map(|i| {
            let (start, end) = (i.saturating_sub(reach), (i + reach + 1).min(values.len()));
            (values[i] - ((sums[end] - sums[start]) / (end - start) as f64) as f32).max(0.0)
        })
        .collect()
}

/// Scales so that strong onsets are 1.
fn normalized(values: &[f32]) -> Vec<f32> {
    // Only frames where something begins: a long silence makes no onset stronger.
    let mut present: Vec<f32> = values.iter().copied().filter(|value| *value > 0.0).collect();
    if present.is_empty() {
        return values.to_vec();
    }
    let rank = ((present.len() - 1) as f64 * STRONG_QUANTILE) as usize;
    let (_, strong, _) = present.select_nth_unstable_by(rank, f32::total_cmp);
    let scale = 1.0 / strong.max(f32::MIN_POSITIVE);
    values.iter().map(|value| (value * scale).min(3.0)).collect()
}
