//! The GGX lobe as a table of taps, for normal = view.

use bevy::math::{DVec3, Vec4};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Taps a level can have, as in `filter_pass.wgsl`.
pub(super) const MAX_TAPS: usize = 24;

/// Standard deviation of what a trilinear lookup of the pyramid covers, in texels of its level: each level is a quadratic spline
/// of the one above, and interpolated.
const TAP_SPREAD: f64 = 0.65;
/// How much wider it is in the mean over all levels between two.
const BETWEEN_LEVELS: f64 = 1.15;
/// Variance that the reader's own interpolation adds, in squared texels of the level made. It is 1 ÷ 6 in the mean over all places
/// between texels; a little more makes up for texels that are wider than high.
const READER_VARIANCE: f64 = 0.3;

/// A ring of taps around the mirror direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ring {
    taps: usize,
    /// Angle from the axis ÷ alpha.
    radius: f64,
    /// Standard deviation of a tap ÷ alpha.
    spread: f64,
}

impl Ring {
    const fn new(taps: usize, radius: f64, spread: f64) -> Self {
        Self { taps, radius, spread }
    }
}

/// For levels of many texels. Radii and spreads were found by a search for the least error of real rooms at alpha 0.04 in a
/// simulation of the whole path; the shares are fitted for each level.
const FEW: &[Ring] = &[Ring::new(4, 0.89, 0.688), Ring::new(4, 2.66, 1.362)];
/// For levels of few texels, where an alpha is many texels of the source wide; from the same search at alpha 0.16.
const MANY: &[Ring] = &[Ring::new(5, 0.574, 0.402), Ring::new(7, 1.389, 0.484), Ring::new(8, 2.573, 0.779)];

/// Taps for a level with this edge length.
pub(super) fn rings(edge: u32) -> &'static [Ring] {
    if edge > 32 { FEW } else { MANY }
}

/// What a lobe is made of.
pub(super) struct Lobe {
    /// Direction to the light relative to the normal (z), and level of the pyramid; and the tap's share.
    pub(super) taps: Vec<(Vec4, f32)>,
    /// Share of the next rougher level: the far tails of GGX are alike whatever their alpha. With it, all shares sum up to 1.
    pub(super) tail: f32,
}

/// The kernel of the glossy maps by the angle to the light, without its norm.
fn ggx(alpha: f64, angle: f64) -> f64 {
    let cosine = angle.cos().max(0.0);
    cosine / (0.5 * (1.0 + cosine) * (alpha * alpha - 1.0) + 1.0).powi(2)
}

/// The shares with which taps on rings, each a Gaussian spot, and the next rougher level together come closest to the lobe in
/// the mean square over the hemisphere. The pyramid starts at half of `source_edge`; `edge` is that of the level made.
pub(super) fn fit(alpha: f64, rougher: f64, rings: &[Ring], source_edge: u32, edge: u32) -> Lobe {
    const STEPS: usize = 2048;
    const AZIMUTHS: usize = 48;
    let texel = |edge: f64| (4.0 * PI / 6.0).sqrt() / edge;
    let finest = TAP_SPREAD * texel(0.5 * f64::from(source_edge));
    let levels: Vec<f64> = rings.iter().map(|ring| (ring.spread * alpha / finest).log2().max(0.0)).collect();
    let ring_profile = |ring: &Ring, level: f64, angle: f64| {
        let variance =
            (BETWEEN_LEVELS * finest * level.exp2()).powi(2) + READER_VARIANCE * texel(f64::from(edge)).powi(2);
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
    let target = normalized(&|angle| ggx(alpha, angle));
    let mut parts: Vec<Vec<f64>> =
        rings.iter().zip(&levels).map(|(ring, level)| normalized(&|angle| ring_profile(ring, *level, angle))).collect();
    parts.push(normalized(&|angle| ggx(rougher, angle)));
    let weights: Vec<f64> = angles.iter().map(|angle| angle.sin()).collect();
    let shares = least_squares(&parts, &target, &weights);
    let sum: f64 = shares.iter().sum();
    let mut taps = Vec::new();
    for (i, (ring, level)) in rings.iter().zip(&levels).enumerate() {
        let (sin, cos) = (ring.radius * alpha).sin_cos();
        for k in 0..ring.taps {
            // Every other ring is turned by half a step, so that taps do not line up.
            let (y, x) = (TAU * (k as f64 + 0.5 * i as f64) / ring.taps as f64).sin_cos();
            let place = DVec3::new(sin * x, sin * y, cos).as_vec3().extend(*level as f32);
            let share = shares[i] / sum / ring.taps as f64;
            if share > 0.0 {
                taps.push((place, share as f32));
            }
        }
    }
    Lobe { taps, tail: (shares[rings.len()] / sum) as f32 }
}

/// The shares ≥ 0 of `parts` whose sum is nearest to `target`: the most negative one is left out until there is none.
fn least_squares(parts: &[Vec<f64>], target: &[f64], weights: &[f64]) -> Vec<f64> {
    let product =
        |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(weights).map(|((a, b), weight)| a * b * weight).sum() };
    let mut active: Vec<usize> = (0..parts.len()).collect();
    loop {
        let rows = active.iter().map(|&i| {
            let row = active.iter().map(|&j| product(&parts[i], &parts[j]));
            row.chain([product(&parts[i], target)]).collect()
        });
        let solution = solve(rows.collect());
        let least = (0..active.len()).min_by(|a, b| solution[*a].total_cmp(&solution[*b]));
        match least {
            Some(least) if solution[least] < 0.0 && active.len() > 1 => {
                active.remove(least);
            }
            _ => {
                let mut shares = vec![0.0; parts.len()];
                active.iter().zip(solution).for_each(|(i, share)| shares[*i] = share.max(0.0));
                return shares;
            }
        }
    }
}

/// Gauss–Jordan for a symmetric positive system with its right side as last column.
fn solve(mut rows: Vec<Vec<f64>>) -> Vec<f64> {
    let count = rows.len();
    for i in 0..count {
        let pivot = rows[i].clone();
        for (k, row) in rows.iter_mut().enumerate() {
            let factor = if k == i { 0.0 } else { row[i] / pivot[i] };
            row.iter_mut().zip(&pivot).for_each(|(value, above)| *value -= factor * above);
        }
    }
    rows.iter().enumerate().map(|(i, row)| row[count] / row[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_are_unit_vectors_above_the_horizon_around_the_normal() {
        for (alpha, rougher, edge) in [(0.04, 0.16, 64), (0.16, 0.36, 32), (0.028, 0.11, 128)] {
            let lobe = fit(alpha, rougher, rings(edge), 2 * edge.max(64), edge);
            assert!((1..=MAX_TAPS).contains(&lobe.taps.len()));
            let sum: f32 = lobe.taps.iter().map(|tap| tap.1).sum();
            assert!((sum + lobe.tail - 1.0).abs() < 1e-5 && lobe.tail >= 0.0);
            let mean: bevy::math::Vec3 = lobe.taps.iter().map(|tap| tap.0.truncate() * tap.1).sum();
            assert!(lobe.taps.iter().all(|tap| tap.0.z > 0.0 && (tap.0.truncate().length() - 1.0).abs() < 1e-6));
            assert!(mean.truncate().length() < 1e-3, "leans to a side: {mean}");
        }
    }

    #[test]
    fn shares_are_found_again() {
        let parts = [vec![1.0, 0.0, 1.0, 0.5], vec![0.0, 1.0, 1.0, 0.1], vec![1.0, 1.0, 0.0, 0.7]];
        let target: Vec<f64> = (0..4).map(|i| 0.25 * parts[0][i] + 0.75 * parts[2][i]).collect();
        let shares = least_squares(&parts, &target, &[1.0; 4]);
        assert!(shares.iter().zip([0.25, 0.0, 0.75]).all(|(a, b)| (a - b).abs() < 1e-9), "{shares:?}");
    }

    #[test]
    fn the_mean_cosine_of_a_lobe_is_kept() {
        // ∫ z² D dω ÷ ∫ z D dω by fine steps, against taps and tail; spots widen what lies around the axis.
        let mean_cosine = |alpha: f64| {
            let steps = (0..10_000).map(|i| (f64::from(i) + 0.5) * FRAC_PI_2 / 1e4);
            let (weight, moment) = steps.fold((0.0, 0.0), |(weight, moment), angle| {
                let value = ggx(alpha, angle) * angle.sin();
                (weight + value, moment + value * angle.cos())
            });
            moment / weight
        };
        let lobe = fit(0.16, 0.36, rings(32), 128, 32);
        let taps: f64 = lobe.taps.iter().map(|tap| f64::from(tap.0.z * tap.1)).sum();
        let mean = taps + f64::from(lobe.tail) * mean_cosine(0.36);
        assert!((mean - mean_cosine(0.16)).abs() < 0.02, "{mean} instead of {}", mean_cosine(0.16));
    }
}
