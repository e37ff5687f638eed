//! Corners of a marker from all of its edges: the printed pattern is aligned with the frame in linear light.
//!
//! The detector finds the outline from gradients of coded values, which blur shifts towards the dark side. Here the
//! whole pattern counts, outline and bits, in linear light, where blur shifts no edge. Unknown are the homography from
//! the frame to the pattern, the blur, the light on the paper (a plane) and that on the ink (constant); Gauss-Newton on
//! the difference of every pixel near an edge (the inverse compositional view of Lucas & Kanade 1981, with robust
//! weights) finds them together in a few steps.

use super::{MarkerPattern, pose::unit_square_to, pose_fit::solve};
use crate::{camera::FramePixels, luminance::luminance};
use bevy::math::{DMat3, DVec2, DVec3, DVec4, Vec4};

/// Number of pixels that are compared at most, roughly. More would not make corners better than the paper is flat.
const MAX_PIXELS: f64 = 6500.0;
/// Half of the width of a blurred edge at the start, and its bounds, in pixels.
const START_BLUR: f64 = 1.4;
/// Error in pixels of the corners at the start, up to which all edges take part.
const START_ERROR: f64 = 1.0;
/// One of so many pixels without an edge is compared, for the light.
const FLAT_STRIDE: u32 = 7;
const BLUR: std::ops::RangeInclusive<f64> = 0.6..=6.0;
/// Largest half of the width of a blurred edge, in cells. Of smaller cells, nothing is left.
const MAX_BLUR_CELLS: f64 = 1.0;
/// Difference from the pattern at which a pixel counts half, as a fraction of the contrast. Shadow edges, glare and
/// fingers differ by more.
const TOLERANCE: f64 = 0.12;
/// The same at the start, when edges are not where they should be.
const START_TOLERANCE: f64 = 0.3;
/// Smallest contrast between paper and ink, in units of the sensor's white.
const MIN_CONTRAST: f64 = 0.004;
/// Its multiples are spread evenly between whole numbers.
const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
/// Distance in pixels by which corners move in the last step.
const MIN_STEP: f64 = 0.05;
const MAX_STEPS: usize = 8;
/// Numbers that are sought: homography, light on the paper, light on the ink, blur.
const UNKNOWNS: usize = 13;

/// Where a pattern fits the frame best.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Alignment {
    /// Corners of the square, in pixels.
    pub corners: [DVec2; 4],
    /// Share of the pattern that agrees with the frame, 0…1. Without any likeness it is about a half.
    pub agreement: f64,
}

/// Moves the corners of a marker to where its pattern fits the frame best. Returns `None` if it fits nowhere nearby.
pub(super) fn align_pattern(frame: &FramePixels, corners: &[DVec2; 4], pattern: &MarkerPattern) -> Option<Alignment> {
    let mut fit = Fit::new(corners, pattern)?;
    let pixels = fit.pixels(frame);
    fit.estimate_light(&pixels)?;
    let mut before = *corners;
    for step in 0..MAX_STEPS {
        fit.step(&pixels, if step < 2 { START_TOLERANCE } else { TOLERANCE })?;
        let after = fit.corners()?;
        let moved = before.iter().zip(&after).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        before = after;
        if step >= 2 && moved < MIN_STEP {
            break;
        }
    }
    let is_lit = fit.light[0] > fit.light[3] + MIN_CONTRAST;
    is_lit.then_some(Alignment { corners: before, agreement: fit.agreement })
}

/// A pixel that is compared: its center and its value.
struct Pixel {
    center: DVec2,
    value: f64,
}

struct Fit<'a> {
    pattern: &'a MarkerPattern,
    /// Pixels are counted from here, in units of `scale` pixels.
    middle: DVec2,
    scale: f64,
    /// Frame → cells.
    homography: DMat3,
    /// Light on the paper in the middle, its change per cell to the right and down, and light on the ink.
    light: [f64; 4],
    /// Half of the width of a blurred edge in pixels.
    blur: f64,
    /// Mean likeness of the pixels and the pattern, 0…1.
    agreement: f64,
}

impl<'a> Fit<'a> {
    fn new(corners: &[DVec2; 4], pattern: &'a MarkerPattern) -> Option<Self> {
        let count = pattern.cells.len() as f64;
        let middle = corners.iter().sum::<DVec2>() / 4.0;
        let scale = corners.iter().map(|corner| corner.distance(middle)).fold(0.0, f64::max);
        let margin = 0.5 * (count - f64::from(pattern.square));
        let side = f64::from(pattern.square);
        let frame_from_unit = unit_square_to(&corners.map(|corner| (corner - middle) / scale))?;
        let unit_from_cells = DMat3::from_cols(
            DVec3::new(1.0 / side, 0.0, 0.0),
            DVec3::new(0.0, 1.0 / side, 0.0),
            DVec3::new(-margin / side, -margin / side, 1.0),
        );
        let cells_from_frame = (frame_from_unit * unit_from_cells).inverse();
        let homography = cells_from_frame * (1.0 / cells_from_frame.z_axis.z);
        let is_usable = homography.is_finite() && scale > 0.0;
        is_usable.then_some(Self {
            pattern,
            middle,
            scale,
            homography,
            light: [0.0; 4],
            blur: START_BLUR,
            agreement: 0.0,
        })
    }

    /// Position in cells of a point of the frame (in units of `scale` around the middle).
    fn cell_at(&self, at: DVec2) -> (DVec2, f64) {
        let p = self.homography * at.extend(1.0);
        (p.truncate() / p.z, p.z)
    }

    /// Where the fit has the corners of the square, in pixels.
    fn corners(&self) -> Option<[DVec2; 4]> {
        let frame_from_cells = self.homography.inverse();
        let low = 0.5 * (self.pattern.cells.len() as f64 - f64::from(self.pattern.square));
        let high = low + f64::from(self.pattern.square);
        let corners = [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| {
            let p = frame_from_cells * DVec3::new(x, y, 1.0);
            self.middle + self.scale * p.truncate() / p.z
        });
        corners.iter().all(|corner| corner.is_finite()).then_some(corners)
    }

    /// The pixels near edges, and a few of those between.
    fn pixels(&self, frame: &FramePixels) -> Vec<Pixel> {
        let count = self.pattern.cells.len() as f64;
        let frame_from_cells = self.homography.inverse();
        let outline = [(0.0, 0.0), (count, 0.0), (count, count), (0.0, count)].map(|(x, y)| {
            let p = frame_from_cells * DVec3::new(x, y, 1.0);
            self.middle + self.scale * p.truncate() / p.z
        });
        let low = outline.iter().copied().reduce(DVec2::min).unwrap_or_default().max(DVec2::ZERO);
        let high = outline.iter().copied().reduce(DVec2::max).unwrap_or_default().min(frame.size.as_dvec2());
        let area = (high - low).max(DVec2::ZERO).element_product();
        let stride = (area / MAX_PIXELS).max(1.0);
        // Edges count within reach of the start's error.
        let reach = (START_BLUR + START_ERROR) / START_BLUR;
        let mut pixels = Vec::new();
        for y in low.y as u32..high.y as u32 {
            // Every row and every column takes part, or sharp edges along them would have room to move.
            let first = low.x.floor() + (f64::from(y) * GOLDEN_RATIO).fract() * stride;
            let columns = ((high.x.floor() - first) / stride).ceil().max(0.0) as u32;

            for column in 0..columns {
                let x = (first + f64::from(column) * stride) as u32;
                let center = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let at = (center - self.middle) / self.scale;
                let (cell, depth) = self.cell_at(at);
                // The outermost cells end where the paper may.
                let is_inside = depth > 0.0 && cell.min_element() > 0.2 && cell.max_element() < count - 0.2;
                if !is_inside {
                    continue;
                }
                let shade = self.pattern.shade(cell, reach * self.blur_in_cells(cell, depth));
                if shade.by_cell != DVec2::ZERO || (x + 3 * y).is_multiple_of(FLAT_STRIDE) {
                    let value = f64::from(luminance(frame.linear(x as i32, y as i32)));
                    pixels.push(Pixel { center: at, value });
                }
            }
        }
        pixels
    }

    /// Blur in cells at a point of the frame.
    fn blur_in_cells(&self, cell: DVec2, depth: f64) -> DVec2 {
        let h = &self.homography;
        let row = |i: usize| DVec2::new(h.x_axis[i], h.y_axis[i]);
        let by_pixel = |i: usize, value: f64| (row(i) - value * row(2)).length() / (depth * self.scale);
        let blur = self.blur * DVec2::new(by_pixel(0, cell.x), by_pixel(1, cell.y));
        blur.min(DVec2::splat(MAX_BLUR_CELLS))
    }

    fn estimate_light(&mut self, pixels: &[Pixel]) -> Option<()> {
        let (mut paper, mut ink) = ((0.0, 0.0), (0.0, 0.0));
        for pixel in pixels {
            let (cell, depth) = self.cell_at(pixel.center);
            let shade = self.pattern.shade(cell, self.blur_in_cells(cell, depth)).value;
            if shade > 0.99 {
                paper = (paper.0 + pixel.value, paper.1 + 1.0);
            } else if shade < 0.01 {
                ink = (ink.0 + pixel.value, ink.1 + 1.0);
            }
        }
        let (paper, ink) = (paper.0 / paper.1, ink.0 / ink.1);
        self.light = [paper, 0.0, 0.0, ink];
        (paper > ink).then_some(())
    }

    /// One step of Gauss-Newton.
    fn step(&mut self, pixels: &[Pixel], tolerance: f64) -> Option<()> {
        let middle_cell = 0.5 * self.pattern.cells.len() as f64;
        let tolerance = tolerance * (self.light[0] - self.light[3]);
        let mut system = System::default();
        let mut likenesses = 0.0;
        for Pixel { center, value } in pixels {
            let (cell, depth) = self.cell_at(*center);
            let shade = self.pattern.shade(cell, self.blur_in_cells(cell, depth));
            let [paper, to_right, down, ink] = self.light;
            let from_middle = cell - middle_cell;
            let contrast = paper + to_right * from_middle.x + down * from_middle.y - ink;
            let residual = value - (ink + contrast * shade.value);
            // What is covered must not pull at all, hence the square (Geman & McClure 1985).
            let likeness = tolerance * tolerance / (tolerance * tolerance + residual * residual);
            let weight = likeness * likeness;
            likenesses += likeness;
            let lit = shade.value;
            let by_light = DVec4::new(lit, lit * from_middle.x, lit * from_middle.y, 1.0 - lit).as_vec4();
            if shade.by_cell == DVec2::ZERO {
                // Without an edge, only the light shows.
                system.add(&[by_light], residual as f32, weight as f32);
                continue;
            }
            let g = contrast * shade.by_cell / depth;
            let z = -g.dot(cell);
            let row = [
                by_light,
                DVec4::new(g.x * center.x, g.x * center.y, g.x, g.y * center.x).as_vec4(),
                DVec4::new(g.y * center.y, g.y, z * center.x, z * center.y).as_vec4(),
                DVec4::new(contrast * shade.by_blur / self.blur, 0.0, 0.0, 0.0).as_vec4(),
            ];
            system.add(&row, residual as f32, weight as f32);
        }
        let step = system.solve()?;
        let h = &mut self.homography;
        h.x_axis += DVec3::new(step[4], step[7], step[10]);
        h.y_axis += DVec3::new(step[5], step[8], step[11]);
        h.z_axis += DVec3::new(step[6], step[9], 0.0);
        for (light, step) in self.light.iter_mut().zip(step) {
            *light += step;
        }
        self.blur = (self.blur + step[12].clamp(-0.5, 0.5)).clamp(*BLUR.start(), *BLUR.end());
        self.agreement = likenesses / pixels.len() as f64;
        Some(())
    }
}

/// Normal equations, four unknowns at a time: light, homography, blur.
#[derive(Default)]
struct System {
    /// Row `4 · a + i` of the normal matrix, up to column `4 · a + 3`.
    normal: [[Vec4; 4]; 16],
    right: [Vec4; 4],
}

impl System {
    /// Adds a pixel with its derivatives by the first unknowns; the others do not show in it.
    fn add(&mut self, row: &[Vec4], residual: f32, weight: f32) {
        for (a, by_unknowns) in row.iter().enumerate() {
            let weighted = *by_unknowns * weight;
            self.right[a] += weighted * residual;
            for (i, weight) in weighted.to_array().into_iter().enumerate() {
                for (sum, other) in self.normal[4 * a + i].iter_mut().zip(&row[..=a]) {
                    *sum += *other * weight;
                }
            }
        }
    }

    fn solve(&self) -> Option<[f64; UNKNOWNS]> {
        let mut normal = std::array::from_fn(|i| std::array::from_fn(|j| f64::from(self.normal[i][j / 4][j % 4])));
        for (i, row) in normal.iter_mut().enumerate() {
            let row: &mut [f64; UNKNOWNS] = row;
            row[i] = row[i] * (1.0 + 1e-6) + 1e-12;
        }
        solve(normal, std::array::from_fn(|i| f64::from(self.right[i / 4][i % 4])))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::prelude::{Srgba, UVec2};

    const COUNT: usize = 10;
    /// Samples per pixel along each axis.
    const SAMPLES: i32 = 8;

    fn pattern(seed: u32) -> MarkerPattern {
        let is_white = |x: usize, y: usize| {
            let ring = x.min(y).min(COUNT - 1 - x).min(COUNT - 1 - y);
            let mixed = (x as u32 * 31 + y as u32 * 417 + seed * 6007).wrapping_mul(0x9E37_79B9);
            let bit = (mixed ^ mixed >> 15).wrapping_mul(0x85EB_CA6B) >> 31;
            ring == 0 || ring > 1 && bit == 1
        };
        let cells = (0..COUNT).map(|y| (0..COUNT).map(|x| is_white(x, y)).collect()).collect();
        MarkerPattern { cells, square: 8 }
    }

    /// Corners of a square that is turned a little.
    fn corners(side: f64) -> [DVec2; 4] {
        let turn =
            |x: f64, y: f64| DVec2::new(40.3 + side * (0.96 * x - 0.28 * y), 38.7 + side * (0.28 * x + 0.96 * y));
        [turn(-0.5, -0.5), turn(0.5, -0.5), turn(0.5, 0.5), turn(-0.5, 0.5)]
    }

    /// A frame with the pattern, blurred in linear light over a square of so many pixels, and dark beyond a column.
    fn frame(pattern: &MarkerPattern, corners: &[DVec2; 4], blur: i32, dark_from: f64) -> FramePixels {
        let size = UVec2::splat(80);
        let [origin, right, down] = [corners[0], corners[1] - corners[0], corners[3] - corners[0]];
        let value = |at: DVec2| {
            let (u, v) = ((at - origin).dot(right), (at - origin).dot(down));
            let cell = DVec2::new(u, v) / right.length_squared() * 8.0 + 1.0;
            let is_paper = cell.min_element() >= 0.0 && cell.max_element() < COUNT as f64;
            match () {
                () if at.x > dark_from => 0.02,
                () if !is_paper => 0.2,
                () if pattern.cells[cell.y as usize][cell.x as usize] => 0.7,
                () => 0.03,
            }
        };
        // Every second sample is taken.
        let sample = |x: i32, y: i32| value((DVec2::new(x.into(), y.into()) + 1.0) / f64::from(SAMPLES));
        let reach = SAMPLES * blur;
        let rgba = (0..80 * 80).flat_map(|i| {
            let (x, y) = (i % 80 * SAMPLES, i / 80 * SAMPLES);
            let start = (SAMPLES - reach) / 2;
            let all = (start..start + reach)
                .step_by(2)
                .flat_map(|dy| (start..start + reach).step_by(2).map(move |dx| (dx, dy)));
            let values: Vec<f64> = all.map(|(dx, dy)| sample(x + dx, y + dy)).collect();
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let byte = (Srgba::gamma_function_inverse(mean as f32) * 255.0 + 0.5) as u8;
            [byte, byte, byte, 255]
        });
        FramePixels::new(size, rgba.collect()).expect("as many bytes as the size says")
    }

    fn worst(found: &[DVec2; 4], expected: &[DVec2; 4]) -> f64 {
        found.iter().zip(expected).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max)
    }

    #[test]
    fn corners_are_found_to_fractions_of_a_pixel_however_blurred() {
        for (side, blur, limit) in [(56.0, 1, 0.03), (56.0, 3, 0.03), (56.0, 5, 0.05), (20.0, 2, 0.1)] {
            let (pattern, truth) = (pattern(1), corners(side));
            let start = truth.map(|corner| corner + DVec2::new(0.6, -0.5));
            let fit = align_pattern(&frame(&pattern, &truth, blur, 80.0), &start, &pattern).expect("fits");
            let off = worst(&fit.corners, &truth);
            println!("{side} px wide, blurred over {blur} px: {off:.4} px, agreement {:.3}", fit.agreement);
            assert!(off < limit && fit.agreement > 0.9, "{side}, {blur}: {off} px, {fit:?}");
        }
    }

    #[test]
    fn what_covers_a_part_hardly_moves_the_rest() {
        let (pattern, truth) = (pattern(1), corners(56.0));
        let fit = align_pattern(&frame(&pattern, &truth, 2, 58.0), &truth, &pattern).expect("fits");
        let off = worst(&fit.corners, &truth);
        println!("{off:.3} px, agreement {:.3}", fit.agreement);
        assert!(off < 0.3 && (0.6..0.95).contains(&fit.agreement), "{off} px, {fit:?}");
    }

    #[test]
    fn another_pattern_does_not_agree() {
        let truth = corners(56.0);
        let fit = align_pattern(&frame(&pattern(1), &truth, 2, 80.0), &truth, &pattern(77));
        assert!(fit.is_none_or(|fit| fit.agreement < 0.78), "{fit:?}");
        let gray = FramePixels::new(UVec2::splat(80), vec![90; 4 * 6400]).expect("as many bytes as the size says");
        assert_eq!(align_pattern(&gray, &truth, &pattern(1)), None);
    }
}
