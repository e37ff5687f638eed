//! Audio devices that play and report positions in blocks, and songs on them, for tests of clocks.

use crate::random::Random;
use crate::rules::SongClock;

/// Time of a frame in seconds.
pub(crate) const FRAME: f64 = 1.0 / 60.0;

/// How an audio device plays and reports positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Device {
    /// Shortest and longest block in seconds.
    pub blocks: [f64; 2],
    /// Reports are off by up to this many seconds, either for a whole block or for each report on its own.
    pub noise: f64,
    pub is_noise_of_block: bool,
    /// Rate against the wall clock, less 1.
    pub drift: f64,
}

pub(crate) const QUIET: Device = Device { blocks: [0.010; 2], noise: 0.0, is_noise_of_block: true, drift: 0.0 };

/// Audio that plays on a device.
pub(crate) struct Playback {
    device: Device,
    random: Random,
    /// What is heard, and start, end and noise of the block that it is in.
    pub heard: f64,
    start: f64,
    end: f64,
    noise: f64,
}

impl Playback {
    fn new(device: Device, seed: u64) -> Self {
        let mut playback = Self { device, random: Random::new(seed), heard: 0.0, start: 0.0, end: 0.0, noise: 0.0 };
        playback.play(playback.random.clone().between(0.0, 0.02));
        playback
    }

    pub(crate) fn play(&mut self, seconds: f64) {
        self.heard += seconds * (1.0 + self.device.drift);
        while self.end <= self.heard {
            let [shortest, longest] = self.device.blocks;
            self.start = self.end;
            self.end += self.random.between(shortest, longest);
            self.noise = self.report_noise();
        }
    }

    pub(crate) fn move_to(&mut self, seconds: f64) {
        (self.heard, self.start, self.end) = (seconds, seconds, seconds);
        self.play(0.0);
    }

    fn report_noise(&mut self) -> f64 {
        self.random.between(-self.device.noise, self.device.noise)
    }

    pub(crate) fn position(&mut self) -> f64 {
        let noise = if self.device.is_noise_of_block { self.noise } else { self.report_noise() };
        self.start + noise
    }
}

/// A song that plays, seen by its clock.
pub(crate) struct Song {
    pub playback: Playback,
    pub clock: SongClock,
    frames: Random,
    frame_seconds: f64,
    pub time: f64,
}

impl Song {
    pub(crate) fn new(device: Device, seed: u64, frame_seconds: f64) -> Self {
        let clock = SongClock::starting_at(0.0);
        Self { playback: Playback::new(device, seed), clock, frames: Random::new(!seed), frame_seconds, time: 0.0 }
    }

    /// Advances by a frame and returns by how much the clock is ahead of what is heard. Checks that it does not run
    /// backwards.
    pub(crate) fn frame(&mut self) -> f64 {
        // Frames are not quite even.
        let delta = self.frame_seconds * self.frames.between(0.93, 1.07);
        self.time += delta;
        self.playback.play(delta);
        let before = self.clock.seconds();
        let now = self.clock.advance(delta, Some(self.playback.position()));
        assert!(now >= before, "at {} s from {before} to {now}", self.time);
        now - self.playback.heard
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        let end = self.time + seconds;
        while self.time < end {
            self.frame();
        }
    }

    /// Lets the device stand still, while wall clock and frames go on.
    pub(crate) fn stall(&mut self, seconds: f64) {
        let position = self.playback.position();
        for _ in 0..(seconds / FRAME) as u32 {
            self.time += FRAME;
            self.clock.advance(FRAME, Some(position));
        }
    }
}
