//! Feeds of frames with what the fields sense in them.

use super::{
    field_state::{Change, FieldState},
    hands::{Cover, Tap},
    lighting::Lighting,
    random::Random,
    renderer::{Picture, Renderer, Sensor},
    sense::{FieldReading, read_field},
    sheet_contrast::SheetContrast,
    sheet_view::{FIELDS, SheetView, grid},
};
use glam::Vec2;

/// Frames per second.
const RATE: f64 = 30.0;

/// A feed, and what changes in it.
pub(super) struct Feed {
    pub(super) renderer: Renderer,
    pub(super) lighting: Lighting,
    pub(super) taps: Vec<Tap>,
    pub(super) sensor: Sensor,
    /// Largest error of the pose in pixels.
    pub(super) pose_error: f32,
    /// Quality of JPEG compression, 1…100, if there is any.
    pub(super) jpeg_quality: Option<u8>,
    /// Whether exposure follows the light.
    pub(super) is_exposure_automatic: bool,
    random: Random,
    states: [FieldState; 4],
    frames: u32,
    drift: Vec2,
}

/// What a frame brought.
pub(super) struct Sensed {
    pub(super) seconds: f64,
    pub(super) coverage: [Option<f32>; 4],
    pub(super) changes: [Option<Change>; 4],
}

impl Feed {
    /// A feed without taps, in steady light.
    pub(super) fn new(view: SheetView, seed: u64) -> Self {
        Self {
            renderer: Renderer::new(view),
            lighting: Lighting::steady(),
            taps: Vec::new(),
            sensor: Sensor::USUAL,
            pose_error: 1.0,
            jpeg_quality: None,
            is_exposure_automatic: false,
            random: Random::new(seed),
            states: [FieldState::default(); 4],
            frames: 0,
            drift: Vec2::ZERO,
        }
    }

    /// Taps on random fields, some on two at a time.
    pub(super) fn tap(&mut self, seconds: f64, covers: &[Cover]) {
        let mut at = 0.5;
        while at < seconds - 1.0 {
            let field = self.random.below(4);
            let cover = covers[self.random.below(covers.len())];
            let tap = Tap::natural(field, at, cover, &mut self.random);
            let mut end = tap.end();
            self.taps.push(tap);
            if self.random.unit() < 0.2 {
                let other = (field + 2) % 4;
                let tap = Tap::natural(other, at + f64::from(self.random.between(0.0, 0.02)), cover, &mut self.random);
                end = end.max(tap.end());
                self.taps.push(tap);
            }
            at = end + f64::from(self.random.between(0.05, 0.4));
        }
    }

    /// The next frame.
    pub(super) fn step(&mut self) -> Sensed {
        let seconds = f64::from(self.frames) / RATE;
        self.frames += 1;
        let active: Vec<Tap> =
            self.taps.iter().filter(|tap| tap.begin < seconds && tap.end() > seconds - 0.05).copied().collect();
        let light = self.lighting.at(seconds);
        let mut picture = self.renderer.frame(seconds, &active, &light, &self.sensor, &mut self.random);
        if let Some(quality) = self.jpeg_quality {
            picture = picture.compressed(quality);
        }
        if self.is_exposure_automatic {
            let wanted = self.sensor.exposure * 0.3 / self.renderer.mean(&picture).max(0.01);
            self.sensor.exposure *= (wanted / self.sensor.exposure).powf(0.15);
        }
        // Half of the error stays for a while, the other half is new in each frame.
        let half = 0.5 * self.pose_error;
        if self.frames % 20 == 1 {
            self.drift = half * Vec2::from_angle(self.random.between(0.0, 6.3));
        }
        let error = self.drift + half * Vec2::from_angle(self.random.between(0.0, 6.3)) * self.random.unit();
        let coverage = sense(&self.renderer.view, &picture, error);
        let mut changes = [None; 4];
        for ((change, state), coverage) in changes.iter_mut().zip(&mut self.states).zip(coverage) {
            *change = state.update(coverage, seconds);
        }
        Sensed { seconds, coverage, changes }
    }

    /// Frames up to a time.
    pub(super) fn run(&mut self, seconds: f64) -> Vec<Sensed> {
        let count = (seconds * RATE) as u32;
        (0..count).map(|_| self.step()).collect()
    }
}

/// Coverage of all fields in a picture, seen with a pose that is off by some pixels.
fn sense(view: &SheetView, picture: &Picture, error: Vec2) -> [Option<f32>; 4] {
    let readings: [Option<FieldReading>; 4] = FIELDS.map(|middle| {
        let project = |p: Vec2| Some(view.project((middle + p).extend(0.0))? + error);
        read_field(&grid(), project, |pixel| picture.luminance(pixel), picture.size)
    });
    let sheet = SheetContrast::of(readings.iter().flatten());
    readings.map(|reading| sheet?.coverage(&reading?))
}
