//! Noise of a frame by brightness, channel and octave, from its flattest blocks.
//!
//! Each level of a pyramid of the frame is filtered with the mask that Immerkær 1996 measures noise with: it ignores
//! brightness and slopes. In blocks of each brightness, the mean square of the result has a distribution whose lower
//! end is that of blocks without texture (as the lower envelope of Liu et al. 2006); from there the variance is
//! estimated.

use super::noise_tile::{OCTAVES, kernel};
use crate::{camera::FramePixels, least_squares::NormalEquations};
use bevy::prelude::*;

/// Steps of brightness, in luma of the sRGB-encoded frame. Twin of `BINS` in `grain_pass.wgsl`.
pub(super) const BINS: usize = 16;
/// Red, green, blue and luma.
const CHANNELS: usize = 4;
/// Weights of red, green and blue in luma (ITU-R BT.601). Mirror of `LUMA_WEIGHTS` in `grain_pass.wgsl`.
pub(super) const LUMA_WEIGHTS: Vec3 = Vec3::new(0.299, 0.587, 0.114);
/// Edge of a block, in pixels of its level.
const BLOCK: usize = 8;
/// Distances between blocks, by level: they overlap where there are few.
const STRIDES: [usize; OCTAVES] = [8, 4, 4];
/// Values up to which and from which a pixel may be clipped, in steps of the frame.
const CLIPPED: [u8; 2] = [1, 254];
/// Blocks from which a variance is estimated: of one step of brightness, or with its neighbors.
const MIN_BLOCKS: [usize; 2] = [16, 8];
/// Fraction of the blocks of a brightness that have to be without texture.
const FLAT_FRACTION: f64 = 0.1;
/// Degrees of freedom of the mean square in a block. White noise has 64 responses whose squares are correlated:
/// 64 ÷ (1 + 2·(4/9 + 1/36))².
const FREEDOM: f64 = 17.0;
/// Blocks above this multiple of the variance are textured. Without them, the mean of all others is lower by the factor
/// of [`TRIMMED_MEAN`].
const TEXTURED: f64 = 1.5;
const TRIMMED_MEAN: f64 = 0.949;
/// Largest ratio of the variances of neighboring steps of brightness: more is texture.
const MAX_STEP: f64 = 1.4;
/// Largest ratio of the variance of a coarser level, relative to the finest one, to the smallest such ratio of all
/// steps of brightness: more is texture, which adds to coarse levels above all.
const MAX_COARSENESS: f64 = 1.3;
/// Blocks of one step of brightness from which that smallest ratio is taken.
const MIN_SHAPE_BLOCKS: usize = 30;
/// Variance of rounding to a step, which the output of the renderer has too.
const ROUNDING: f64 = 1.0 / 12.0;
/// Smallest variance that counts, in squared steps.
const MIN_VARIANCE: f64 = 1e-3;

/// Variances of the noise by octave and brightness, in squared steps of the 8-bit sRGB frame: red, green, blue, luma.
pub(super) type Variances = [[Vec4; BINS]; OCTAVES];

/// Level of the pyramid of a frame.
struct Level {
    width: usize,
    height: usize,
    planes: [Vec<f32>; CHANNELS],
    is_clipped: Vec<bool>,
}

impl Level {
    fn of(frame: &FramePixels) -> Self {
        let plane = |channel: usize| frame.rgba.chunks_exact(4).map(|pixel| f32::from(pixel[channel])).collect();
        let luma = |pixel: &[u8]| Vec3::from_slice(&[pixel[0], pixel[1], pixel[2]].map(f32::from)).dot(LUMA_WEIGHTS);
        let is_clipped = |pixel: &[u8]| pixel[..3].iter().any(|value| *value <= CLIPPED[0] || *value >= CLIPPED[1]);
        Self {
            width: frame.size.x as usize,
            height: frame.size.y as usize,
            planes: [plane(0), plane(1), plane(2), frame.rgba.chunks_exact(4).map(luma).collect()],
            is_clipped: frame.rgba.chunks_exact(4).map(is_clipped).collect(),
        }
    }

    /// The next level: means of 2 × 2 pixels.
    fn halved(&self) -> Self {
        let (width, height) = (self.width / 2, self.height / 2);
        let corners = |i: usize| {
            let first = i / width * 2 * self.width + i % width * 2;
            [first, first + 1, first + self.width, first + self.width + 1]
        };
        let plane = |plane: &Vec<f32>| {
            (0..width * height).map(|i| 0.25 * corners(i).map(|at| plane[at]).iter().sum::<f32>()).collect()
        };
        let is_clipped = |i: usize| corners(i).into_iter().any(|at| self.is_clipped[at]);
        Self {
            width,
            height,
            planes: self.planes.each_ref().map(plane),
            is_clipped: (0..width * height).map(is_clipped).collect(),
        }
    }

    /// Blocks without clipped pixels.
    fn blocks(&self, stride: usize) -> Vec<Block> {
        let rows = (1..self.height.saturating_sub(BLOCK)).step_by(stride);
        let places = rows.flat_map(|y| (1..self.width.saturating_sub(BLOCK)).step_by(stride).map(move |x| (x, y)));
        places.filter_map(|(x, y)| self.block(x, y)).collect()
    }

    fn block(&self, x: usize, y: usize) -> Option<Block> {
        let rows = || (y - 1..=y + BLOCK).map(|y| y * self.width);
        let is_clipped = rows().any(|row| self.is_clipped[row + x - 1..=row + x + BLOCK].contains(&true));
        if is_clipped {
            return None;
        }
        let area = (BLOCK * BLOCK) as f32;
        let inside = || (y..y + BLOCK).flat_map(|y| (x..x + BLOCK).map(move |x| y * self.width + x));
        let luma = inside().map(|at| self.planes[CHANNELS - 1][at]).sum::<f32>() / area;
        let variance = |plane: &Vec<f32>| {
            let row = |at: usize| plane[at - 1] - 2.0 * plane[at] + plane[at + 1];
            let response = |at: usize| row(at - self.width) - 2.0 * row(at) + row(at + self.width);
            f64::from(inside().map(|at| response(at).powi(2)).sum::<f32>() / area / 36.0)
        };
        Some(Block { luma, variances: self.planes.each_ref().map(variance) })
    }
}

/// Mean luma of a block, and the variance of white noise with which its responses would be as they are.
struct Block {
    luma: f32,
    variances: [f64; CHANNELS],
}

/// Measures the noise of a frame. `None` if no part of it tells: all is clipped, or it is tiny.
pub(super) fn measure_noise(frame: &FramePixels) -> Option<Variances> {
    let mut level = Level::of(frame);
    let mut bands = Vec::new();
    for stride in STRIDES {
        bands.push(level.blocks(stride));
        level = level.halved();
    }
    let channels = (0..CHANNELS).map(|channel| channel_noise(&bands, channel)).collect::<Option<Vec<_>>>()?;
    let at = |octave: usize, bin: usize| std::array::from_fn(|channel| channels[channel][bin][octave] as f32);
    Some(std::array::from_fn(|octave| std::array::from_fn(|bin| Vec4::from_array(at(octave, bin)))))
}

/// Variances of a channel by brightness and octave, from the blocks of each level.
fn channel_noise(levels: &[Vec<Block>], channel: usize) -> Option<[[f64; OCTAVES]; BINS]> {
    let mut measured: Vec<[f64; BINS]> = Vec::new();
    for (level, blocks) in levels.iter().enumerate() {
        let mut band = band(blocks, channel, rounding(channel) / 4_f64.powi(level as i32));
        if let Some(finest) = measured.first() {
            limit_coarseness(&mut band, finest);
        }
        // Where a small frame has too few blocks, the noise is taken for white.
        let band = filled(&band).or_else(|| measured.last().map(|finer| finer.map(|variance| 0.25 * variance)))?;
        measured.push(band);
    }
    Some(std::array::from_fn(|bin| octaves(std::array::from_fn(|level| measured[level][bin]))))
}

/// Variance of the rounding of a channel.
fn rounding(channel: usize) -> f64 {
    ROUNDING * if channel < 3 { 1.0 } else { f64::from(LUMA_WEIGHTS.length_squared()) }
}

/// Variance at a brightness, and the number of its own blocks if these were enough, else 0.
type Bin = Option<(f64, usize)>;

/// Variance of a channel by brightness, without that of rounding, where there are enough blocks.
fn band(blocks: &[Block], channel: usize, rounding: f64) -> [Bin; BINS] {
    let width = 256.0 / BINS as f32;
    let mut bins: [Bin; BINS] = std::array::from_fn(|bin| {
        let center = (bin as f32 + 0.5) * width;
        [(0.5, MIN_BLOCKS[0]), (1.5, MIN_BLOCKS[1])].into_iter().find_map(|(reach, min)| {
            let near = blocks.iter().filter(|block| (block.luma - center).abs() <= reach * width);
            let variances: Vec<f64> = near.map(|block| block.variances[channel]).collect();
            let own = if reach < 1.0 { variances.len() } else { 0 };
            (variances.len() >= min).then(|| ((flat_variance(variances) - rounding).max(0.0), own))
        })
    });
    for _ in 0..BINS {
        for bin in 0..BINS {
            let neighbors = [bin.checked_sub(1), Some(bin + 1)].into_iter().flatten();
            let limit = neighbors.filter_map(|at| *bins.get(at)?).map(|(variance, _)| MAX_STEP * variance);
            let limit = limit.fold(f64::INFINITY, f64::min).max(2.0 * rounding);
            bins[bin] = bins[bin].map(|(variance, own)| (variance.min(limit), own));
        }
    }
    bins
}

/// Lowers variances of a coarser level whose ratio to the finest one is larger than noise has it elsewhere.
fn limit_coarseness(bins: &mut [Bin; BINS], finest: &[f64; BINS]) {
    let ratio = |(bin, finest): (&Bin, &f64)| {
        let (variance, _) = bin.filter(|(_, own)| *own >= MIN_SHAPE_BLOCKS && *finest > MIN_VARIANCE)?;
        Some(variance / finest)
    };
    let limit = MAX_COARSENESS * bins.iter().zip(finest).filter_map(ratio).fold(f64::INFINITY, f64::min);
    if limit.is_finite() {
        for (bin, finest) in bins.iter_mut().zip(finest) {
            *bin = bin.map(|(variance, own)| (variance.min(limit * finest), own));
        }
    }
}

/// Variances with those between and beyond the known ones. `None` if none is known.
fn filled(bins: &[Bin; BINS]) -> Option<[f64; BINS]> {
    let known: Vec<(usize, f64)> =
        bins.iter().enumerate().filter_map(|(bin, value)| Some((bin, (*value)?.0))).collect();
    let ((_, first), (_, last)) = (known.first()?, known.last()?);
    Some(std::array::from_fn(|bin| match known.iter().position(|(at, _)| *at >= bin) {
        Some(0) => *first,
        None => *last,
        Some(next) => {
            let ((low, a), (high, b)) = (known[next - 1], known[next]);
            a + (b - a) * (bin - low) as f64 / (high - low) as f64
        }
    }))
}

/// Variance of noise in blocks of which some are without texture.
fn flat_variance(mut variances: Vec<f64>) -> f64 {
    variances.sort_unstable_by(f64::total_cmp);
    let rank = (FLAT_FRACTION * variances.len() as f64) as usize;
    let mut variance = variances[rank] / chi_square_quantile((rank as f64 + 0.5) / variances.len() as f64);
    for _ in 0..2 {
        let flat = &variances[..variances.partition_point(|value| *value <= TEXTURED * variance)];
        if flat.is_empty() {
            break;
        }
        variance = flat.iter().sum::<f64>() / flat.len() as f64 / TRIMMED_MEAN;
    }
    variance
}

/// Quantile of a χ² distribution of [`FREEDOM`], relative to its mean (Wilson and Hilferty 1931), for probabilities
/// below a half, with the normal quantile of Abramowitz and Stegun 26.2.23.
fn chi_square_quantile(probability: f64) -> f64 {
    let t = (-2.0 * probability.ln()).sqrt();
    let normal =
        (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308))) - t;
    let spread = 2.0 / (9.0 * FREEDOM);
    (1.0 - spread + normal * spread.sqrt()).powi(3)
}

/// Variance that an octave of unit variance shows at a level of the pyramid.
fn response(level: usize, octave: usize) -> f64 {
    let step = 1 << level;
    let mut mask = vec![0.0; 2 * step + 1];
    (mask[0], mask[step], mask[2 * step]) = (1.0, -2.0, 1.0);
    let box_filter = vec![1.0 / step as f64; step];
    let all = convolved(&convolved(&kernel(octave), &box_filter), &mask);
    (all.iter().map(|value| value * value).sum::<f64>() / 6.0).powi(2)
}

fn convolved(a: &[f64], b: &[f64]) -> Vec<f64> {
    let mut result = vec![0.0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        b.iter().enumerate().for_each(|(j, y)| result[i + j] += x * y);
    }
    result
}

/// Variances of the octaves that together show what the levels of the pyramid show.
fn octaves(levels: [f64; OCTAVES]) -> [f64; OCTAVES] {
    let mut equations = NormalEquations::new(OCTAVES);
    for (level, variance) in levels.into_iter().enumerate() {
        let row: [(usize, f64); OCTAVES] = std::array::from_fn(|octave| (octave, response(level, octave)));
        equations.add(&row, variance, 1.0 / variance.max(MIN_VARIANCE).powi(2));
    }
    let solved = equations.solve_non_negative();
    std::array::from_fn(|octave| solved[octave])
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(600, 320);
    /// The three octaves show noise that is smooth over 2 × 2 pixels with 1.01, 0.83 and 1.08 of its deviation at the
    /// three levels at best; beside that there is the error of measurement.
    const MAX_LEVEL_ERROR: f64 = 0.25;

    /// White noise of variance 1.
    fn white(seed: u32) -> Vec<f64> {
        let uniform = |i: u32| f64::from(super::super::noise_tile::hash(i ^ (seed << 24))) / f64::from(u32::MAX) - 0.5;
        let normal = |i: u32| (0..12).map(|k| uniform(i * 12 + k)).sum::<f64>();
        (0..SIZE.element_product()).map(normal).collect()
    }

    /// Noise of variance 1 that is smooth over 2 × 2 pixels.
    fn coarse(seed: u32) -> Vec<f64> {
        let (white, w) = (white(seed), SIZE.x as usize);
        let at = |i: usize| white[i % white.len()];
        (0..white.len()).map(|i| 0.5 * (at(i) + at(i + 1) + at(i + w) + at(i + w + 1))).collect()
    }

    /// A scene in steps of the frame: patches of several brightnesses with a slope, and stripes in a part of it.
    fn scene(x: u32, y: u32) -> f64 {
        let patch = f64::from(40 + 35 * ((x / 100) % 6)) + 0.03 * f64::from(y);
        let texture = if y > 220 { 12.0 * f64::from(x + 2 * y).sin() } else { 0.0 };
        patch + texture
    }

    fn frame(noise: impl Fn(usize, f64) -> [f64; 3]) -> FramePixels {
        let pixel = |i: u32| {
            let value = scene(i % SIZE.x, i / SIZE.x);
            let [r, g, b] = noise(i as usize, value).map(|noise| (value + noise).round().clamp(0.0, 255.0) as u8);
            [r, g, b, 255]
        };
        FramePixels::new(SIZE, (0..SIZE.element_product()).flat_map(pixel).collect()).expect("as many as the size says")
    }

    fn bin(value: f64) -> usize {
        (value / 16.0) as usize
    }

    #[test]
    fn white_noise_is_found_in_the_finest_octave_by_brightness() {
        let planes = [white(1), white(2), white(3)];
        let deviation = |value: f64| 1.0 + 3.0 * value / 255.0;
        let found = measure_noise(&frame(|i, value| std::array::from_fn(|c| deviation(value) * planes[c][i])));
        let found = found.expect("there are flat blocks");
        for value in [50.0, 85.0, 120.0, 155.0, 190.0, 225.0] {
            for channel in 0..3 {
                let total: f32 = found.iter().map(|octave| octave[bin(value)][channel]).sum();
                let (fine, expected) = (found[0][bin(value)][channel].sqrt(), deviation(value) as f32);
                println!("{value}, channel {channel}: {expected} expected, {fine} fine, {} in all", total.sqrt());
                assert!((total.sqrt() / expected - 1.0).abs() < 0.15 && fine > 0.85 * expected);
            }
            let luma: f32 = found.iter().map(|octave| octave[bin(value)][3]).sum();
            assert!((luma.sqrt() / (deviation(value) as f32 * LUMA_WEIGHTS.length()) - 1.0).abs() < 0.15);
        }
    }

    #[test]
    fn coarse_noise_has_the_variance_and_the_spectrum_that_it_has() {
        let plane = coarse(5);
        let found = measure_noise(&frame(|i, _| [2.5 * plane[i]; 3])).expect("there are flat blocks");
        let kernel = vec![0.5_f64.sqrt(); 2];
        for value in [85.0, 120.0, 190.0] {
            let octaves: [f64; OCTAVES] = std::array::from_fn(|octave| f64::from(found[octave][bin(value)][1]));
            for level in 0..OCTAVES {
                let step = 1 << level;
                let mut mask = vec![0.0; 2 * step + 1];
                (mask[0], mask[step], mask[2 * step]) = (1.0, -2.0, 1.0);
                let all = convolved(&convolved(&kernel, &vec![1.0 / step as f64; step]), &mask);
                let truth = 2.5 * (all.iter().map(|value| value * value).sum::<f64>() / 6.0);
                let modeled = (0..OCTAVES).map(|octave| octaves[octave] * response(level, octave)).sum::<f64>().sqrt();
                println!("{value}, level {level}: {truth} expected, {modeled} found");
                assert!((modeled / truth - 1.0).abs() < MAX_LEVEL_ERROR);
            }
            let luma: f32 = found.iter().map(|octave| octave[bin(value)][3]).sum();
            println!("{value}: deviation {} of 2.5, luma {}", octaves.iter().sum::<f64>().sqrt(), luma.sqrt());
            assert!((octaves.iter().sum::<f64>().sqrt() / 2.5 - 1.0).abs() < 0.15);
            assert!((luma.sqrt() / 2.5 - 1.0).abs() < 0.15, "gray noise is alike in all channels");
        }
    }

    #[test]
    fn texture_is_not_noise() {
        let found = measure_noise(&frame(|_, _| [0.0; 3])).expect("there are flat blocks");
        let worst = found.iter().flatten().map(|variance| variance.max_element()).fold(0.0, f32::max);
        println!("largest deviation {} steps", worst.sqrt());
        assert!(worst.sqrt() < 0.3);
    }

    #[test]
    fn what_one_brightness_has_more_of_in_coarse_levels_is_texture() {
        let mut bins: [Bin; BINS] =
            std::array::from_fn(|bin| Some((if bin == 9 { 6.0 } else { 1.0 }, MIN_SHAPE_BLOCKS)));
        bins[3] = None;
        limit_coarseness(&mut bins, &[2.0; BINS]);
        assert_eq!((bins[9], bins[3]), (Some((MAX_COARSENESS, MIN_SHAPE_BLOCKS)), None));
        assert_eq!(filled(&bins).map(|bins| bins[3]), Some(1.0));
        assert_eq!(filled(&[None; BINS]), None);
    }

    #[test]
    fn clipped_frames_tell_nothing() {
        let white = FramePixels::new(SIZE, vec![255; 4 * SIZE.element_product() as usize]).expect("as many as needed");
        assert!(measure_noise(&white).is_none());
        let tiny = FramePixels::new(UVec2::new(3, 2), vec![90; 24]).expect("as many as needed");
        assert!(measure_noise(&tiny).is_none());
    }
}
