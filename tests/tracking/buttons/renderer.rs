//! Frames of the sheet with hands above it, as a webcam delivers them: 8 bits of sRGB.
//!
//! Only the fields' surroundings are rendered; the rest is black.

use super::{
    hands::{Capsule, Tap, shadow},
    lighting::FrameLight,
    random::Random,
    sheet_view::{SheetView, ink_at},
};
use glam::{Vec2, Vec3};
use image::{ExtendedColorType, codecs::jpeg::JpegEncoder};
use std::sync::LazyLock;

/// Rays for each pixel along a side, for the print; and rays for each pixel where hands may be.
const PRINT_SAMPLES: usize = 5;
const HAND_SAMPLES: usize = 8;
/// Times within an exposure at which hands are seen.
const SLICES: usize = 4;
/// Reflectance of paper, ink and desk.
const PAPER: Vec3 = Vec3::new(0.85, 0.86, 0.86);
const INK: Vec3 = Vec3::splat(0.045);
const DESK: Vec3 = Vec3::new(0.3, 0.2, 0.12);
const TO_LAMP: Vec3 = Vec3::new(-0.3, -0.4, 0.87);

/// What the camera does to a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensor {
    /// Factor on all light.
    pub(super) exposure: f32,
    /// Length of the exposure in seconds, for hands in motion.
    pub(super) shutter: f64,
    /// Standard deviation of blur in pixels, across and down.
    pub(super) blur: Vec2,
    /// Standard deviation of noise in the dark, and its variance per light.
    pub(super) read_noise: f32,
    pub(super) shot_noise: f32,
}

impl Sensor {
    pub(super) const USUAL: Self =
        Self { exposure: 1.0, shutter: 0.012, blur: Vec2::splat(0.5), read_noise: 0.002, shot_noise: 2e-4 };
}

/// A sheet as one camera sees it; the print is rendered once.
pub(super) struct Renderer {
    pub(super) view: SheetView,
    region: (usize, usize, usize, usize),
    print: Vec<(Vec2, Vec3)>,
    linear: Vec<Vec3>,
}

/// A frame in 8 bits of sRGB.
pub(super) struct Picture {
    pub(super) size: Vec2,
    pub(super) rgb: Vec<[u8; 3]>,
}

impl Renderer {
    pub(super) fn new(view: SheetView) -> Self {
        let region = view.region();
        let (left, top, right, bottom) = region;
        let mut print = Vec::new();
        for (y, x) in (top..bottom).flat_map(|y| (left..right).map(move |x| (y, x))) {
            let mut albedo = Vec3::ZERO;
            for i in 0..PRINT_SAMPLES * PRINT_SAMPLES {
                let part = Vec2::new((i % PRINT_SAMPLES) as f32, (i / PRINT_SAMPLES) as f32) + 0.5;
                let pixel = Vec2::new(x as f32, y as f32) + part / PRINT_SAMPLES as f32;
                let ink = ink_at(view.place(view.ray(pixel)));
                albedo += ink.map_or(DESK, |ink| PAPER.lerp(INK, ink));
            }
            let place = view.place(view.ray(Vec2::new(x as f32, y as f32) + 0.5));
            print.push((place, albedo / (PRINT_SAMPLES * PRINT_SAMPLES) as f32));
        }
        Self { view, region, linear: vec![Vec3::ZERO; print.len()], print }
    }

    /// The frame whose exposure ends at a time.
    pub(super) fn frame(
        &mut self,
        seconds: f64,
        taps: &[Tap],
        light: &FrameLight,
        sensor: &Sensor,
        random: &mut Random,
    ) -> Picture {
        let slices: Vec<Vec<(Capsule, Vec3)>> = (0..SLICES)
            .map(|slice| {
                let at = seconds - sensor.shutter * (slice as f64 + 0.5) / SLICES as f64;
                let mut all = Vec::new();
                for tap in taps {
                    let mut capsules = Vec::new();
                    tap.capsules(at, &mut capsules);
                    all.extend(capsules.into_iter().map(|capsule| (capsule, tap.cover.albedo)));
                }
                all
            })
            .collect();
        let now: Vec<Capsule> = slices[SLICES / 2].iter().map(|(capsule, _)| *capsule).collect();
        let boxes: Vec<(Vec2, Vec2)> = slices.iter().flatten().map(|(capsule, _)| self.bounds(capsule)).collect();
        let (left, top, right, bottom) = self.region;
        let width = right - left;
        for (y, x) in (top..bottom).flat_map(|y| (left..right).map(move |x| (y, x))) {
            let i = (y - top) * width + x - left;
            let (place, albedo) = self.print[i];
            let (irradiance, added) = light.on(place);
            let pixel = Vec2::new(x as f32, y as f32);
            let lit = if now.is_empty() { 1.0 } else { 0.3 + 0.7 * shadow(place, &now, TO_LAMP) };
            let mut color = albedo * irradiance * lit;
            if boxes.iter().any(|(low, high)| pixel.cmpge(*low).all() && pixel.cmple(*high).all()) {
                color = self.with_hands(pixel, color, irradiance, &slices);
            }
            self.linear[i] = (color + added) * sensor.exposure;
        }
        self.blur(sensor.blur);
        self.expose(sensor, random)
    }

    /// Mean light of what was rendered, for automatic exposure.
    pub(super) fn mean(&self, picture: &Picture) -> f32 {
        let (left, top, right, bottom) = self.region;
        let rows = picture.rgb.chunks(picture.size.x as usize).skip(top).take(bottom - top);
        let sum: f32 = rows.flat_map(|row| &row[left..right]).map(|rgb| LINEAR[usize::from(rgb[1])]).sum();
        sum / ((right - left) * (bottom - top)).max(1) as f32
    }

    /// Pixels that a capsule may touch.
    fn bounds(&self, capsule: &Capsule) -> (Vec2, Vec2) {
        let mut bounds = (Vec2::MAX, Vec2::MIN);
        for end in [capsule.from, capsule.to] {
            if let Some(pixel) = self.view.project(end) {
                let reach = 1.3 * capsule.radius * self.view.size.x / 1.15 / end.distance(self.view.position) + 1.5;
                bounds = (bounds.0.min(pixel - reach), bounds.1.max(pixel + reach));
            }
        }
        bounds
    }

    fn with_hands(&self, pixel: Vec2, sheet: Vec3, irradiance: Vec3, slices: &[Vec<(Capsule, Vec3)>]) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for i in 0..HAND_SAMPLES {
            // Points of the R2 sequence (Roberts 2018).
            let part = Vec2::new(0.754_877_7 * i as f32, 0.569_840_3 * i as f32 + 0.5).fract();
            let ray = self.view.ray(pixel + part);
            let mut nearest = f32::MAX;
            let mut color = sheet;
            for (capsule, albedo) in &slices[i % SLICES] {
                if let Some(hit) = capsule.hit(self.view.position, ray).filter(|hit| hit.distance < nearest) {
                    nearest = hit.distance;
                    // Folds of skin and the edge of a nail.
                    let folds = 1.0 + 0.12 * (hit.along * 40.0).sin() - if hit.along < 0.12 { 0.2 } else { 0.0 };
                    color = albedo * irradiance * folds * (0.4 + 0.6 * hit.normal.dot(TO_LAMP).max(0.0));
                }
            }
            sum += color;
        }
        sum / HAND_SAMPLES as f32
    }

    fn blur(&mut self, deviation: Vec2) {
        let (left, top, right, bottom) = self.region;
        let (width, height) = (right - left, bottom - top);
        blur_lines(&mut self.linear, (height, width), (width, 1), deviation.x);
        blur_lines(&mut self.linear, (width, height), (1, width), deviation.y);
    }

    fn expose(&self, sensor: &Sensor, random: &mut Random) -> Picture {
        let (left, top, right, bottom) = self.region;
        let size = self.view.size.as_usizevec2();
        let mut rgb = vec![[0; 3]; size.x * size.y];
        for (y, row) in (top..bottom).zip(self.linear.chunks(right - left)) {
            for (color, pixel) in row.iter().zip(&mut rgb[y * size.x + left..]) {
                *pixel = color.to_array().map(|value| {
                    let value = value.min(4.0);
                    let noise = (sensor.read_noise.powi(2) + sensor.shot_noise * value.max(0.0)).sqrt();
                    encode(value + noise * random.normal())
                });
            }
        }
        Picture { size: self.view.size, rgb }
    }
}

/// Blurs lines in place with a Gaussian. `lines` has their number and length, `strides` the distances of both.
fn blur_lines(values: &mut [Vec3], lines: (usize, usize), strides: (usize, usize), deviation: f32) {
    if deviation < 0.1 {
        return;
    }
    let reach = (2.5 * deviation).ceil() as i32;
    let weights: Vec<f32> = (-reach..=reach).map(|x| (-0.5 * (x as f32 / deviation).powi(2)).exp()).collect();
    let total: f32 = weights.iter().sum();
    let mut line = vec![Vec3::ZERO; lines.1];
    for i in 0..lines.0 {
        for (j, value) in line.iter_mut().enumerate() {
            *value = values[i * strides.0 + j * strides.1];
        }
        for j in 0..lines.1 {
            let mut sum = Vec3::ZERO;
            for (weight, x) in weights.iter().zip(-reach..) {
                sum += *weight * line[(j as i32 + x).clamp(0, lines.1 as i32 - 1) as usize];
            }
            values[i * strides.0 + j * strides.1] = sum / total;
        }
    }
}

/// Codes of light in 4096 steps of its square root.
static CODES: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let srgb = |x: f32| if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (0..=4096).map(|i| (255.0 * srgb((i as f32 / 4096.0).powi(2))).round() as u8).collect()
});

static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    let linear = |c: f32| if c <= 0.040_45 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
    std::array::from_fn(|code| linear(code as f32 / 255.0))
});

fn encode(linear: f32) -> u8 {
    CODES[(linear.clamp(0.0, 1.0).sqrt() * 4096.0) as usize]
}

impl Picture {
    /// Linear luminance (Rec. 709) at a place in pixels, bilinear between centers.
    pub(super) fn luminance(&self, pixel: Vec2) -> f32 {
        let at = (pixel - 0.5).clamp(Vec2::ZERO, self.size - 1.001);
        let (corner, part) = (at.floor(), at.fract());
        let width = self.size.x as usize;
        let first = corner.y as usize * width + corner.x as usize;
        let value = |i: usize| {
            let [r, g, b] = self.rgb[i.min(self.rgb.len() - 1)].map(|code| LINEAR[usize::from(code)]);
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        let above = value(first) * (1.0 - part.x) + value(first + 1) * part.x;
        let below = value(first + width) * (1.0 - part.x) + value(first + width + 1) * part.x;
        above * (1.0 - part.y) + below * part.y
    }

    /// The frame after JPEG compression of a quality from 1 to 100.
    pub(super) fn compressed(&self, quality: u8) -> Self {
        let size = self.size.as_uvec2();
        let mut jpeg = Vec::new();
        JpegEncoder::new_with_quality(&mut jpeg, quality)
            .encode(self.rgb.as_flattened(), size.x, size.y, ExtendedColorType::Rgb8)
            .expect("the buffer has as many bytes as the size says");
        let decoded = image::load_from_memory(&jpeg).expect("was just encoded").into_rgb8();
        Self { size: self.size, rgb: decoded.pixels().map(|pixel| pixel.0).collect() }
    }
}
