//! Short-time spectra of a song in bands that are spaced as pitch is.
//!
//! Mono samples enter. What leaves is, for each frame, the compressed magnitude of every band: ln(1 + c·m), where m is
//! the band's amplitude relative to the song's own level. So quiet and loud masters of a song have the same spectra.
//! Frames are [`HOP_SECONDS`] apart, and windows are about 23 ms long: long enough for a bass drum, short enough for
//! semiquavers.

use super::decode::Sound;
use std::f32::consts::TAU;
use symphonia::core::dsp::{complex::Complex, fft::Fft};

/// Distance between frames in seconds, before it is rounded to whole samples.
const HOP_SECONDS: f64 = 0.005;
/// Shortest window in seconds; the window is the next power of two in samples.
const MIN_WINDOW_SECONDS: f64 = 0.020;
/// Frames before sample 0, so that a sound that starts there has an onset.
const LEAD_FRAMES: usize = 6;
const BANDS_PER_OCTAVE: f32 = 12.0;
/// Lowest and highest frequency in hertz.
const FREQUENCIES: [f32; 2] = [40.0, 15_000.0];
/// Factor c of the compression.
const COMPRESSION: f32 = 20.0;

/// Spectra of a whole song.
pub(crate) struct Spectra {
    /// Compressed magnitudes, frame after frame.
    magnitudes: Vec<f32>,
    /// Center of each band in hertz.
    pub centers: Vec<f32>,
    /// Root mean square amplitude of each frame, relative to the song's.
    pub loudness: Vec<f32>,
    /// Exact distance between frames in seconds.
    pub hop_seconds: f64,
}

impl Spectra {
    pub(crate) fn of(sound: &Sound) -> Self {
        let rate = f64::from(sound.rate);
        let hop = (HOP_SECONDS * rate).round().max(1.0) as usize;
        let window_length = ((MIN_WINDOW_SECONDS * rate) as usize).next_power_of_two();
        let frames = sound.samples.len().div_ceil(hop) + 2 * LEAD_FRAMES;
        let window: Vec<f32> =
            (0..window_length).map(|i| 0.5 - 0.5 * (TAU * (i as f32 + 0.5) / window_length as f32).cos()).collect();
        let bands = Band::all(sound.rate as f32, window_length);
        let level = level(&sound.samples);
        let mut spectra = Self {
            magnitudes: Vec::with_capacity(frames * bands.len()),
            centers: bands.iter().map(|band| band.center).collect(),
            loudness: Vec::with_capacity(frames),
            hop_seconds: hop as f64 / rate,
        };
        let mut fft = Fft::new(window_length);
        let mut pair = vec![Complex::new(0.0, 0.0); window_length];
        let scale = 1.0 / level;
        for frame in (0..frames).step_by(2) {
            // One complex transform does two real frames, as its real and its imaginary part.
            let starts = [frame, frame + 1]
                .map(|frame| (frame as isize - LEAD_FRAMES as isize) * hop as isize - (window_length / 2) as isize);
            let mut energies = [0.0; 2];
            for (i, value) in pair.iter_mut().enumerate() {
                let [a, b] = starts.map(|start| {
                    let at = usize::try_from(start + i as isize).ok();
                    window[i] * scale * at.and_then(|at| sound.samples.get(at)).copied().unwrap_or(0.0)
                });
                energies[0] += a * a;
                energies[1] += b * b;
                *value = Complex::new(a, b);
            }
            fft.fft_inplace(&mut pair);
            for (part, energy) in energies.into_iter().enumerate().take(frames - frame) {
                // The mean square of the window is 3/8.
                spectra.loudness.push((energy / (0.375 * window_length as f32)).sqrt());
                let amplitude = amplitudes(&pair, part);
                spectra.magnitudes.extend(bands.iter().map(|band| band.compressed(&amplitude)));
            }
        }
        spectra
    }

    pub(crate) fn frames(&self) -> usize {
        self.loudness.len()
    }

    /// Magnitudes of the bands in a frame.
    pub(crate) fn frame(&self, frame: usize) -> &[f32] {
        let bands = self.centers.len();
        &self.magnitudes[frame * bands..(frame + 1) * bands]
    }

    /// Time in seconds of the middle of a frame's window.
    pub(crate) fn seconds(&self, frame: f64) -> f64 {
        (frame - LEAD_FRAMES as f64) * self.hop_seconds
    }

    /// Frame whose window is centered at a time, as a fraction.
    pub(crate) fn frame_at(&self, seconds: f64) -> f64 {
        seconds / self.hop_seconds + LEAD_FRAMES as f64
    }
}

/// Level of the song: root mean square of the samples that are not silence.
fn level(samples: &[f32]) -> f32 {
    const SILENCE: f32 = 1e-4;
    let (sum, count) = samples
        .iter()
        .filter(|sample| sample.abs() > SILENCE)
        .fold((0.0, 0), |(sum, count), sample| (sum + f64::from(sample * sample), count + 1));
    if count == 0 { 1.0 } else { (sum / f64::from(count)).sqrt() as f32 }
}

/// Amplitudes of the sine waves in the real (0) or the imaginary (1) part of what was transformed.
fn amplitudes(pair: &[Complex<f32>], part: usize) -> Vec<f32> {
    let length = pair.len();
    // A sine wave of amplitude 1 has length/4 in its bin through a Hann window; one factor of 2 splits the parts.
    let scale = 2.0 / length as f32;
    (0..length / 2)
        .map(|bin| {
            let positive = pair[bin];
            let negative = pair[(length - bin) % length].conj();
            scale * if part == 0 { positive + negative } else { positive - negative }.norm()
        })
        .collect()
}

/// Weights of the bins of one band, a triangle over the logarithm of the frequency.
struct Band {
    center: f32,
    first_bin: usize,
    weights: Vec<f32>,
}

impl Band {
    fn all(rate: f32, window_length: usize) -> Vec<Self> {
        let hertz_per_bin = rate / window_length as f32;
        let highest = FREQUENCIES[1].min(0.45 * rate);
        let step = 2f32.powf(1.0 / BANDS_PER_OCTAVE);
        // Where pitch is finer than the bins, each bin is a band.
        let mut bins = Vec::new();
        let mut frequency = FREQUENCIES[0];
        while frequency < highest {
            let bin = (frequency / hertz_per_bin).round() as usize;
            if bin > 0 && bins.last() != Some(&bin) {
                bins.push(bin);
            }
            frequency *= step;
        }
        bins.windows(3)
            .map(|edges| {
                let [low, center, high] = [edges[0] as f32, edges[1] as f32, edges[2] as f32];
                let weight = |bin: usize| {
                    let bin = bin as f32;
                    if bin <= center { (bin - low) / (center - low) } else { (high - bin) / (high - center) }
                };
                let weights = (edges[0] + 1..edges[2]).map(weight).collect();
                Self { center: center * hertz_per_bin, first_bin: edges[0] + 1, weights }
            })
            .collect()
    }

    fn compressed(&self, amplitudes: &[f32]) -> f32 {
        let bins = amplitudes.iter().skip(self.first_bin);
        let magnitude: f32 = self.weights.iter().zip(bins).map(|(weight, amplitude)| weight * amplitude).sum();
        (COMPRESSION * magnitude).ln_1p()
    }
}
