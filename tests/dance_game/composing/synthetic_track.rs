//! Music made of numbers, with beats that are known exactly.

use crate::composer::Sound;
use std::f64::consts::TAU;

/// Mono sound that instruments are added to.
#[derive(Clone)]
pub(crate) struct Track {
    samples: Vec<f32>,
    rate: u32,
    /// Times of the beats in seconds.
    pub beats: Vec<f64>,
    noise: u64,
}

#[derive(Clone, Copy)]
pub(crate) enum Drum {
    Bass,
    Snare,
    HiHat,
}

impl Track {
    pub(crate) fn new(rate: u32, seconds: f64) -> Self {
        let samples = vec![0.0; (seconds * f64::from(rate)) as usize];
        Self { samples, rate, beats: Vec::new(), noise: 0x2545_f491_4f6c_dd1d }
    }

    /// Makes a track of constant tempo, from a first beat to half a second before the end.
    pub(crate) fn with_tempo(rate: u32, seconds: f64, first: f64, bpm: f64) -> Self {
        let mut track = Self::new(rate, seconds);
        track.add_beats(first, seconds - 0.5, bpm);
        track
    }

    /// Adds beats up to an end in seconds, and returns when the next one would be.
    pub(crate) fn add_beats(&mut self, first: f64, end: f64, bpm: f64) -> f64 {
        let times = (0..).map(|count| first + f64::from(count) * 60.0 / bpm);
        self.beats.extend(times.clone().take_while(|time| *time < end));
        times.clone().find(|time| *time >= end).unwrap_or(end)
    }

    /// Time of a fraction of the way from a beat to the next.
    pub(crate) fn at(&self, beat: usize, fraction: f64) -> f64 {
        let this = self.beats[beat];
        let next = self.beats.get(beat + 1).copied().unwrap_or_else(|| 2.0 * this - self.beats[beat - 1]);
        this + fraction * (next - this)
    }

    /// Times of all beats, and of so many between each two.
    pub(crate) fn grid(&self, parts: u32) -> Vec<f64> {
        let parts_of = |beat| (0..parts).map(move |part| (beat, f64::from(part) / f64::from(parts)));
        (0..self.beats.len()).flat_map(parts_of).map(|(beat, fraction)| self.at(beat, fraction)).collect()
    }

    pub(crate) fn sound(&self) -> Sound {
        Sound { samples: self.samples.clone(), rate: self.rate }
    }

    /// White noise from −1 to 1 (xorshift, Marsaglia 2003).
    pub(crate) fn white(&mut self) -> f32 {
        self.noise ^= self.noise << 13;
        self.noise ^= self.noise >> 7;
        self.noise ^= self.noise << 17;
        (self.noise >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    pub(crate) fn drum(&mut self, drum: Drum, start: f64, gain: f32) {
        match drum {
            Drum::Bass => self.add(start, 0.25, |_, t| {
                let phase = 50.0 * t + 2.5 * (1.0 - (-t / 0.03).exp());
                gain * ((-t / 0.08).exp() * (TAU * phase).sin()) as f32
            }),
            Drum::Snare => self.add(start, 0.2, |track, t| {
                let body = (TAU * 190.0 * t).sin() * (-t / 0.05).exp();
                gain * (0.4 * body as f32 + 0.5 * track.white() * (-t / 0.06).exp() as f32)
            }),
            Drum::HiHat => self.add(start, 0.05, |track, t| gain * 0.3 * track.white() * (-t / 0.012).exp() as f32),
        }
    }

    /// Adds a tone with overtones that swells within `attack` seconds.
    pub(crate) fn tone(&mut self, start: f64, length: f64, hertz: f64, attack: f64, gain: f32) {
        self.add(start, length, |_, t| {
            let envelope = (t / attack).min(1.0) * ((length - t) / 0.02).clamp(0.0, 1.0) * (-t).exp();
            let wave: f64 = (1..6).map(f64::from).map(|k| (TAU * hertz * k * t).sin() / k).sum();
            gain * (0.4 * envelope * wave) as f32
        });
    }

    /// Adds white noise of a power relative to that of the track.
    pub(crate) fn add_noise(&mut self, power: f32) {
        let own = self.samples.iter().map(|sample| sample * sample).sum::<f32>() / self.samples.len() as f32;
        // The power of noise from −1 to 1 is 1/3.
        let amplitude = (3.0 * power * own).sqrt();
        for i in 0..self.samples.len() {
            self.samples[i] += amplitude * self.white();
        }
    }

    fn add(&mut self, start: f64, length: f64, mut wave: impl FnMut(&mut Self, f64) -> f32) {
        let rate = f64::from(self.rate);
        let first = (start * rate).ceil().max(0.0) as usize;
        let end = (first + (length * rate) as usize).min(self.samples.len());
        for i in first..end {
            let value = wave(self, i as f64 / rate - start);
            self.samples[i] += value;
        }
    }
}
