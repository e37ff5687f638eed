//! The GGX lobe as a table of taps, for normal = view.

use bevy::math::{DVec3, Vec4};
use std::f64::consts::{PI, TAU};

/// Taps a level can have, as in `filter_pass.wgsl`.
pub(super) const MAX_TAPS: usize = 48;

/// Mean solid angle of a texel of a cube with this edge length, in steradian.
fn mean_texel_angle(edge: f64) -> f64 {
    4.0 * PI / (6.0 * edge * edge)
}

/// A lookup of the lobe.
pub(super) struct Tap {
    /// Direction to the light relative to the normal (z), and level of the pyramid.
    pub(super) place: Vec4,
    /// Share of the lobe; they sum up to 1.
    pub(super) weight: f32,
}

/// Ring by ring, each with the same share of the distribution of normals, at the cosine that keeps the ring's first moment;
/// looked up where a texel of the pyramid (which starts at half of `source_edge`) is as large as the tap's part of its ring,
/// `level_bias` levels coarser. What is below the horizon is left out.
pub(super) fn taps(alpha: f64, rings: usize, per_ring: usize, source_edge: u32, level_bias: f64) -> Vec<Tap> {
    const STEPS: usize = 256;
    let cosine = |u: f64| 2.0 * (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u) - 1.0;
    let mut taps = Vec::new();
    for ring in 0..rings {
        let bound = |ring: usize| ring as f64 / rings as f64;
        let inner = (0..STEPS).map(|i| cosine(bound(ring) + (i as f64 + 0.5) / (STEPS * rings) as f64).max(0.0));
        let (weight, moment) = inner.fold((0.0, 0.0), |(weight, moment), z| (weight + z, moment + z * z));
        if weight <= 0.0 {
            continue;
        }
        let z = moment / weight;
        let angle = TAU * (cosine(bound(ring)) - cosine(bound(ring + 1)).max(0.0)) / per_ring as f64;
        let level = 0.5 * (angle / mean_texel_angle(f64::from(source_edge))).log2() - 1.0 + level_bias;
        for i in 0..per_ring {
            // Rings are turned against each other by the golden ratio of a step, so that taps do not line up.
            let azimuth = TAU * (i as f64 + ring as f64 * 0.618_034) / per_ring as f64;
            let across = (1.0 - z * z).max(0.0).sqrt();
            let dir = DVec3::new(across * azimuth.cos(), across * azimuth.sin(), z);
            taps.push(Tap { place: dir.as_vec3().extend(level as f32), weight: weight as f32 });
        }
    }
    let sum: f32 = taps.iter().map(|tap| tap.weight).sum();
    taps.iter_mut().for_each(|tap| tap.weight /= sum);
    taps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_are_unit_vectors_above_the_horizon_around_the_normal() {
        let taps = taps(0.16, 6, 8, 128, 0.0);
        assert!(taps.len() == MAX_TAPS);
        let mean: bevy::math::Vec3 = taps.iter().map(|tap| tap.place.truncate() * tap.weight).sum();
        assert!(taps.iter().all(|tap| tap.place.z > 0.0 && (tap.place.truncate().length() - 1.0).abs() < 1e-6));
        assert!(mean.truncate().length() < 1e-3, "leans to a side: {mean}");
        // ∫ z² D dω ÷ ∫ z D dω at α = 0.16, from the closed form of the distribution of normals by fine steps.
        let steps = (0..100_000).map(|i| (f64::from(i) + 0.5) / 1e5);
        let cosines = steps.map(|u| (2.0 * (1.0 - u) / (1.0 + (0.16f64.powi(2) - 1.0) * u) - 1.0).max(0.0));
        let (weight, moment) = cosines.fold((0.0, 0.0), |(w, m), z| (w + z, m + z * z));
        assert!((f64::from(mean.z) - moment / weight).abs() < 1e-3);
    }
}
