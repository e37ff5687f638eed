//! Lobe as a table of taps, for normal = view.

use super::specular_lobe::SpecularLobe;
use crate::least_squares::NormalEquations;
use bevy::{
    math::{DVec3, Vec3, Vec4},
    render::render_resource::ShaderType,
    shader::ShaderDefVal,
};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Maximum number of taps of a level, as in `taps.wgsl`.
const MAX_TAPS: usize = 24;
/// Maximum number of rings of a level.
const MAX_RINGS: usize = 3;
/// Shader definitions for the number of taps of each ring.
const RING_DEFS: [&str; MAX_RINGS] = ["INNER_TAPS", "MIDDLE_TAPS", "OUTER_TAPS"];

/// Standard deviation of the footprint of a lookup in the pyramid, in texels of its level. Each level is a quadratic
/// spline of the finer one, and is interpolated.
const LEVEL_SIGMA: f64 = 0.65;
/// Mean factor on that standard deviation over all positions between two levels.
const MEAN_LEVEL_WIDENING: f64 = 1.1;
/// Mean variance that linear interpolation adds, in squared texels, over all positions between texels.
const INTERPOLATION_VARIANCE: f64 = 1.0 / 6.0;
/// Variance that the interpolation of the reader adds, in squared texels of the level that is made. A little more than
/// [`INTERPOLATION_VARIANCE`], because texels can be wider than high.
const READER_VARIANCE: f64 = 0.3;

/// Minimum edge length of cubes that taps read.
const MIN_SOURCE_EDGE: u32 = 4;

/// Ring of taps around the mirror direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    taps: usize,
    /// Angle from the axis ÷ alpha.
    radius: f64,
    /// Standard deviation of a tap ÷ alpha.
    sigma: f64,
}

impl Ring {
    const fn new(taps: usize, radius: f64, sigma: f64) -> Self {
        Self { taps, radius, sigma }
    }
}

/// Rings of levels with many texels.
///
/// Radii and standard deviations come from a search for the least error in real rooms at alpha 0.04, with no peak
/// above 1.045 times the true one, in a simulation of the whole path. The weights are fitted for each level.
const FEW: &[Ring] = &[Ring::new(5, 0.912, 0.671), Ring::new(5, 2.909, 1.231)];
/// Rings of levels with few texels, where an alpha is many texels of the source wide. From the same search at alpha
/// 0.16.
const MANY: &[Ring] = &[Ring::new(5, 0.579, 0.515), Ring::new(7, 1.351, 0.633), Ring::new(8, 2.685, 0.846)];

/// The same for cosine lobes, from a search for the smallest difference from the lobe. As many taps, so that the
/// shaders are the same.
const COSINE_FEW: &[Ring] = &[Ring::new(5, 0.865, 1.014), Ring::new(5, 2.157, 0.955)];
const COSINE_MANY: &[Ring] = &[Ring::new(5, 0.52, 0.8), Ring::new(7, 1.296, 0.875), Ring::new(8, 2.38, 0.834)];

/// Choice of rings for a level.
#[derive(Clone, Copy, Debug)]
pub(super) enum TapSet {
    Few,
    Many,
}

impl TapSet {
    /// Rings for a level with this edge length.
    pub(super) fn for_edge(edge: u32) -> Self {
        if edge > 32 { Self::Few } else { Self::Many }
    }

    pub(super) fn rings(self, shape: SpecularLobe) -> &'static [Ring] {
        match (self, shape) {
            (Self::Few, SpecularLobe::Ggx) => FEW,
            (Self::Many, SpecularLobe::Ggx) => MANY,
            (Self::Few, SpecularLobe::Cosine) => COSINE_FEW,
            (Self::Many, SpecularLobe::Cosine) => COSINE_MANY,
        }
    }

    /// Shader definitions for these rings.
    pub(super) fn shader_defs(self) -> Vec<ShaderDefVal> {
        let count = |ring: usize| self.rings(SpecularLobe::Ggx).get(ring).map_or(0, |ring| ring.taps as u32);
        RING_DEFS.iter().enumerate().map(|(i, def)| ShaderDefVal::UInt((*def).into(), count(i))).collect()
    }
}

/// Lobe as a sum of taps.
pub(super) struct Lobe {
    /// Directions to the light relative to the normal (z), ring after ring.
    pub(super) offsets: Vec<Vec3>,
    /// Weight of each tap of a ring, for up to three rings; w: weight of the next rougher level, since the far tails
    /// of GGX are alike for every alpha. The weights of all taps and w add up to 1.
    pub(super) weights: Vec4,
    /// Cube that the taps of each ring read.
    pub(super) sources: Vec<TapSource>,
}

/// [`Lobe`] for the GPU. Mirror of `Taps` in `taps.wgsl`.
#[derive(ShaderType, Clone)]
pub(super) struct TapsUniform {
    weights: Vec4,
    offsets: [Vec4; MAX_TAPS],
}

impl From<&Lobe> for TapsUniform {
    fn from(lobe: &Lobe) -> Self {
        let mut offsets = [Vec4::ZERO; MAX_TAPS];
        offsets.iter_mut().zip(&lobe.offsets).for_each(|(offset, tap)| *offset = tap.extend(0.0));
        Self { weights: lobe.weights, offsets }
    }
}

/// Cube that taps read, made from the pyramid.
#[derive(Clone, Copy, Debug)]
pub(super) struct TapSource {
    /// Edge length in texels.
    pub(super) edge: u32,
    /// Level of the pyramid that the cube shows; level 0 has half the source's edge length.
    pub(super) level: f64,
}

/// Fits the weights of taps on rings, each a Gaussian spot, and of the next rougher level, so that their sum is
/// closest to the lobe in the mean square over the hemisphere. `alpha` is that of the level, `rougher` that of the next
/// one.
///
/// The pyramid starts at half of `source_edge`; `edge` is the edge length of the level that is made.
pub(super) fn fit(shape: SpecularLobe, [alpha, rougher]: [f64; 2], set: TapSet, source_edge: u32, edge: u32) -> Lobe {
    const STEPS: usize = 2048;
    const AZIMUTHS: usize = 48;
    let rings = set.rings(shape);
    let texel = |edge: f64| (4.0 * PI / 6.0).sqrt() / edge;
    let finest = LEVEL_SIGMA * texel(0.5 * f64::from(source_edge));
    // The coarsest cube that is fine enough, and the level at which its footprint is as wide as the ring requires.
    let sources: Vec<TapSource> = rings
        .iter()
        .map(|ring| {
            let sigma = ring.sigma * alpha;
            let mut edge = MIN_SOURCE_EDGE;
            while texel(f64::from(edge)) > sigma && 2 * edge < source_edge {
                edge *= 2;
            }
            let variance = sigma.powi(2) - INTERPOLATION_VARIANCE * texel(f64::from(edge)).powi(2);
            TapSource { edge, level: (variance.max(finest.powi(2)).sqrt() / finest).log2() }
        })
        .collect();
    let ring_profile = |ring: &Ring, source: &TapSource, angle: f64| {
        let variance = (MEAN_LEVEL_WIDENING * finest * source.level.exp2()).powi(2)
            + INTERPOLATION_VARIANCE * texel(f64::from(source.edge)).powi(2)
            + READER_VARIANCE * texel(f64::from(edge)).powi(2);
        let radius = ring.radius * alpha;
        let spots = (0..AZIMUTHS).map(|i| {
            let azimuth = TAU * i as f64 / AZIMUTHS as f64;
            let cosine = angle.cos() * radius.cos() + angle.sin() * radius.sin() * azimuth.cos();
            ((cosine - 1.0) / variance).exp()
        });
        spots.sum::<f64>()
    };
    let angles: Vec<f64> = (0..STEPS).map(|i| (i as f64 + 0.5) * FRAC_PI_2 / STEPS as f64).collect();
    let normalized = |profile: &dyn Fn(f64) -> f64| {
        let mut values: Vec<f64> = angles.iter().map(|angle| profile(*angle)).collect();
        let sum: f64 = values.iter().zip(&angles).map(|(value, angle)| value * angle.sin()).sum();
        values.iter_mut().for_each(|value| *value /= sum);
        values
    };
    let target = normalized(&|angle| shape.kernel(alpha, angle));
    let mut parts: Vec<Vec<f64>> =
        rings.iter().zip(&sources).map(|(ring, from)| normalized(&|angle| ring_profile(ring, from, angle))).collect();
    parts.push(normalized(&|angle| shape.kernel(rougher, angle)));
    let sample_weights: Vec<f64> = angles.iter().map(|angle| angle.sin()).collect();
    let weights = fit_weights(&parts, &target, &sample_weights);
    let sum: f64 = weights.iter().sum();
    let mut lobe = Lobe { offsets: Vec::new(), weights: Vec4::ZERO, sources };
    for (i, ring) in rings.iter().enumerate() {
        let (sin, cos) = (ring.radius * alpha).sin_cos();
        lobe.offsets.extend((0..ring.taps).map(|k| {
            // Every other ring is rotated by half a step, so that taps do not line up.
            let (y, x) = (TAU * (k as f64 + 0.5 * i as f64) / ring.taps as f64).sin_cos();
            DVec3::new(sin * x, sin * y, cos).as_vec3()
        }));
        lobe.weights[i] = (weights[i] / sum / ring.taps as f64) as f32;
    }
    lobe.weights.w = (weights[rings.len()] / sum) as f32;
    lobe
}

/// Weights ≥ 0 of `parts` whose sum is nearest to `target`.
fn fit_weights(parts: &[Vec<f64>], target: &[f64], sample_weights: &[f64]) -> Vec<f64> {
    let mut equations = NormalEquations::new(parts.len());
    for (sample, (wanted, weight)) in target.iter().zip(sample_weights).enumerate() {
        let row: Vec<(usize, f64)> = parts.iter().map(|part| part[sample]).enumerate().collect();
        equations.add(&row, *wanted, *weight);
    }
    equations.solve_non_negative()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Taps with their weights.
    fn taps(lobe: &Lobe, set: TapSet) -> Vec<(Vec3, f32)> {
        let weights =
            set.rings(SpecularLobe::Ggx).iter().enumerate().flat_map(|(i, ring)| vec![lobe.weights[i]; ring.taps]);
        lobe.offsets.iter().copied().zip(weights).collect()
    }

    #[test]
    fn taps_are_unit_vectors_above_the_horizon_around_the_normal() {
        let levels = [(0.04, 0.16, 64), (0.16, 0.36, 32), (0.028, 0.11, 128)];
        let shapes = [SpecularLobe::Ggx, SpecularLobe::Cosine];
        for (shape, (alpha, rougher, edge)) in shapes.into_iter().flat_map(|shape| levels.map(|level| (shape, level))) {
            let set = TapSet::for_edge(edge);
            let lobe = fit(shape, [alpha, rougher], set, 2 * edge.max(64), edge);
            let taps = taps(&lobe, set);
            assert!((1..=MAX_TAPS).contains(&taps.len()) && lobe.offsets.len() == taps.len());
            assert!(lobe.sources.len() <= MAX_RINGS && lobe.sources.iter().all(|source| source.level >= 0.0));
            let sum: f32 = taps.iter().map(|tap| tap.1).sum();
            assert!((sum + lobe.weights.w - 1.0).abs() < 1e-5 && lobe.weights.min_element() >= 0.0);
            let mean: Vec3 = taps.iter().map(|tap| tap.0 * tap.1).sum();
            assert!(taps.iter().all(|tap| tap.0.z > 0.0 && (tap.0.length() - 1.0).abs() < 1e-6));
            assert!(mean.truncate().length() < 1e-3, "leans to a side: {mean}");
        }
    }

    #[test]
    fn the_mean_cosine_of_a_lobe_is_kept() {
        // ∫ z² D dω ÷ ∫ z D dω in fine steps, against taps and tail. The spots widen the part around the axis.
        let mean_cosine = |alpha: f64| {
            let steps = (0..10_000).map(|i| (f64::from(i) + 0.5) * FRAC_PI_2 / 1e4);
            let (weight, moment) = steps.fold((0.0, 0.0), |(weight, moment), angle| {
                let value = SpecularLobe::Ggx.kernel(alpha, angle) * angle.sin();
                (weight + value, moment + value * angle.cos())
            });
            moment / weight
        };
        let lobe = fit(SpecularLobe::Ggx, [0.16, 0.36], TapSet::Many, 128, 32);
        let taps: f64 = taps(&lobe, TapSet::Many).iter().map(|tap| f64::from(tap.0.z * tap.1)).sum();
        let mean = taps + f64::from(lobe.weights.w) * mean_cosine(0.36);
        assert!((mean - mean_cosine(0.16)).abs() < 0.02, "{mean} instead of {}", mean_cosine(0.16));
    }
}
