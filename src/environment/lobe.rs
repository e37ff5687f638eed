//! The GGX lobe as taps and as an integral, for normal = view.

use bevy::math::{DVec3, Vec4};
use std::f64::consts::{PI, TAU};

/// Taps a level can have, as in `filter_pass.wgsl`.
pub(super) const MAX_TAPS: usize = 48;

/// Mean solid angle of a texel of a cube with this edge length, in steradian.
fn mean_texel_angle(edge: f64) -> f64 {
    4.0 * PI / (6.0 * edge * edge)
}

/// Ring by ring, each tap with the same share of the distribution of normals: direction to the light relative to the normal
/// (z) and level of the pyramid that starts at half of `source_edge`. Taps below the horizon are left out.
pub(super) fn taps(alpha: f64, rings: usize, per_ring: usize, source_edge: u32, level_bias: f64) -> Vec<Vec4> {
    let count = (rings * per_ring) as f64;
    let mut taps = Vec::new();
    for (ring, i) in (0..rings).flat_map(|ring| (0..per_ring).map(move |i| (ring, i))) {
        let u = (ring as f64 + 0.5) / rings as f64;
        let cos_half_squared = (1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u);
        let (cos_half, sin_half) = (cos_half_squared.sqrt(), (1.0 - cos_half_squared).sqrt());
        // Rings are turned against each other by the golden ratio of a step, so that taps do not line up.
        let azimuth = TAU * (i as f64 + ring as f64 * 0.618_034) / per_ring as f64;
        let half = DVec3::new(sin_half * azimuth.cos(), sin_half * azimuth.sin(), cos_half);
        let dir = 2.0 * cos_half * half - DVec3::Z;
        if dir.z <= 0.0 {
            continue;
        }
        let d = cos_half_squared * (alpha * alpha - 1.0) + 1.0;
        let density = alpha * alpha / (PI * d * d) / 4.0;
        let level =
            0.5 * (1.0 / (count * density) / mean_texel_angle(f64::from(source_edge))).log2() - 1.0 + level_bias;
        taps.push(dir.as_vec3().extend(level as f32));
    }
    taps
}

/// ∫ cos θ / d(θ)² over the hemisphere, where d is the denominator of GGX for the half vector towards θ.
pub(super) fn lobe_integral(alpha: f64) -> f64 {
    const STEPS: u32 = 10_000;
    let step = 1.0 / f64::from(STEPS);
    let terms = (0..STEPS).map(|i| {
        let cosine = (f64::from(i) + 0.5) * step;
        let d = 0.5 * (1.0 + cosine) * (alpha * alpha - 1.0) + 1.0;
        cosine / (d * d) * step
    });
    TAU * terms.sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_roughest_lobe_is_a_cosine() {
        assert!((lobe_integral(1.0) - PI).abs() < 1e-6);
    }

    #[test]
    fn taps_are_unit_vectors_above_the_horizon_around_the_normal() {
        let taps = taps(0.16, 6, 8, 128, 0.0);
        assert!(taps.len() > 40 && taps.len() <= MAX_TAPS);
        let sum: bevy::math::Vec3 = taps.iter().map(|tap| tap.truncate()).sum();
        assert!(taps.iter().all(|tap| tap.z > 0.0 && (tap.truncate().length() - 1.0).abs() < 1e-6));
        assert!(sum.truncate().length() < 1e-3 * taps.len() as f32, "leans to a side: {sum}");
    }
}
