//! Frames with a printed marker on a cluttered desk, as a webcam sees it: rendered on the CPU in linear light, blurred,
//! sRGB-encoded and noisy.

use bevy::prelude::*;
use bevy_mirrorball::{camera::FramePixels, prelude::Intrinsics};

/// Samples per pixel along each axis where the paper is.
const SAMPLES: u32 = 4;
/// Reflectance of paper and ink.
const PAPER: f32 = 0.8;
const INK: f32 = 0.04;
/// Number of rectangles that lie about.
const CLUTTER: u32 = 120;

/// A sequence of numbers that looks random and is the same in every run.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x2545_F491_4F6C_DD1D)
    }

    /// A number in 0…1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 24) as f32
    }

    /// A normally distributed number of variance 1, nearly.
    fn normal(&mut self) -> f32 {
        ((0..6).map(|_| self.unit()).sum::<f32>() - 3.0) * 2.0_f32.sqrt()
    }
}

/// A desk with a marker.
pub(crate) struct MarkerDesk {
    intrinsics: Intrinsics,
    /// Cells of the print with its margin; `true` is white.
    cells: Vec<Vec<bool>>,
    /// Width of a cell in meters.
    cell: f32,
    /// Linear values of the desk without the marker.
    clutter: Vec<f32>,
    /// Standard deviation of the blur in pixels.
    pub(crate) blur: f32,
    /// Standard deviation of the noise, in steps of the 8-bit frame.
    pub(crate) noise: f32,
}

impl MarkerDesk {
    /// A marker of the family tag36h11 whose square is `size` meters wide.
    pub(crate) fn new(intrinsics: Intrinsics, cells: Vec<Vec<bool>>, size: f32) -> Self {
        let mut random = Random::new(7);
        let extent = intrinsics.size;
        let mut clutter = vec![0.25; extent.element_product() as usize];
        for _ in 0..CLUTTER {
            let mut between = |low: f32, high: f32| low + (high - low) * random.unit();
            let (x, y) = (between(0.0, extent.x as f32), between(0.0, extent.y as f32));
            let (width, height, value) = (between(4.0, 120.0), between(4.0, 90.0), between(0.02, 0.7));
            for row in y as u32..(y + height).min(extent.y as f32) as u32 {
                for column in x as u32..(x + width).min(extent.x as f32) as u32 {
                    clutter[(row * extent.x + column) as usize] = value;
                }
            }
        }
        Self { intrinsics, cell: size / 8.0, cells, clutter, blur: 0.8, noise: 3.0 }
    }

    /// The frame of a camera that has the marker at this pose; `seed` is that of the noise.
    pub(crate) fn frame(&self, camera_from_marker: Isometry3d, seed: u64) -> FramePixels {
        let size = self.intrinsics.size;
        let mut linear = self.clutter.clone();
        let half = 0.5 * self.cell * (self.cells.len() as f32 + 2.0);
        let corner = |x: f32, z: f32| {
            let at = camera_from_marker.transform_point(Vec3::new(x * half, 0.0, z * half));
            self.intrinsics.project(at.into()).expect("in front of the camera")
        };
        let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        let low = corners.iter().copied().reduce(Vec2::min).expect("four").max(Vec2::ZERO).as_uvec2();
        let high = (corners.iter().copied().reduce(Vec2::max).expect("four").ceil().as_uvec2() + 1).min(size);
        let marker_from_camera = camera_from_marker.inverse();
        let eye = Vec3::from(marker_from_camera.translation);
        for y in low.y..high.y {
            for x in low.x..high.x {
                let at = &mut linear[(y * size.x + x) as usize];
                let behind = *at;
                let mut sum = 0.0;
                for sample in 0..SAMPLES * SAMPLES {
                    let offset = Vec2::new((sample % SAMPLES) as f32, (sample / SAMPLES) as f32) + 0.5;
                    let pixel = Vec2::new(x as f32, y as f32) + offset / SAMPLES as f32;
                    let ray = marker_from_camera.rotation * self.intrinsics.ray(pixel);
                    let hit = eye - ray * (eye.y / ray.y);
                    sum += self.reflectance(hit.xz()).unwrap_or(behind);
                }
                *at = sum / (SAMPLES * SAMPLES) as f32;
            }
        }
        let linear = blurred(&blurred(&linear, size, UVec2::X, self.blur), size, UVec2::Y, self.blur);
        let mut random = Random::new(seed);
        let rgba = linear.iter().flat_map(|value| {
            let encoded = Srgba::gamma_function_inverse(*value) * 255.0 + self.noise * random.normal();
            let byte = (encoded + 0.5).clamp(0.0, 255.0) as u8;
            [byte, byte, byte, 255]
        });
        FramePixels::new(size, rgba.collect()).expect("as many bytes as the size says")
    }

    /// Reflectance of the paper at a point of it, in meters from the middle of the marker. `None` beside the paper.
    fn reflectance(&self, at: Vec2) -> Option<f32> {
        let count = self.cells.len() as i32;
        let cell = (at / self.cell + 0.5 * count as f32).floor().as_ivec2();
        if cell.min_element() < -1 || cell.max_element() > count {
            return None;
        }
        let row = usize::try_from(cell.y).ok().and_then(|row| self.cells.get(row));
        let is_white = row.zip(usize::try_from(cell.x).ok()).and_then(|(row, column)| row.get(column)).unwrap_or(&true);
        Some(if *is_white { PAPER } else { INK })
    }
}

/// Blurs rows (`UVec2::X`) or columns by a Gaussian.
fn blurred(values: &[f32], size: UVec2, along: UVec2, sigma: f32) -> Vec<f32> {
    let reach = (3.0 * sigma).ceil() as i32;
    let weights: Vec<f32> = (-reach..=reach).map(|i| (-0.5 * (i as f32 / sigma).powi(2)).exp()).collect();
    let sum: f32 = weights.iter().sum();
    let last = size.as_ivec2() - 1;
    let at = |x: i32, y: i32| values[(y.clamp(0, last.y) * (last.x + 1) + x.clamp(0, last.x)) as usize];
    let pixels = (0..=last.y).flat_map(|y| (0..=last.x).map(move |x| (x, y)));
    let step = along.as_ivec2();
    let blur = |(x, y): (i32, i32)| {
        let taps = (-reach..=reach).zip(&weights);
        taps.map(|(i, weight)| weight * at(x + i * step.x, y + i * step.y)).sum::<f32>() / sum
    };
    pixels.map(blur).collect()
}
