//! Exponents of highlights and perceptual roughness.

/// Largest exponent that is told from a perfect mirror: highlights are less than a degree wide.
const MAX_EXPONENT: f32 = 1e5;

/// Perceptual roughness of a surface whose highlight is max(N·H, 0)ⁿ (Blinn 1977), for exponents n ≥ 0.
///
/// With n = 2 ÷ α² − 2 and α the square of the perceptual roughness (Walter, Marschner, Li and Torrance 2007,
/// *Microfacet Models for Refraction through Rough Surfaces*; Karis 2013, *Real Shading in Unreal Engine 4*), the lobe
/// is as high in its middle as that of a `StandardMaterial`. A lobe of max(R·L, 0)ⁿ around the reflected ray (Phong) is
/// as wide as one around the normal with an exponent four times as large. Negative numbers and NaN count as 0, whose
/// roughness is 1; exponents above 100 000 as 100 000.
///
/// ```
/// # use bevy_mirrorball::materials::{exponent_from_perceptual_roughness, perceptual_roughness_from_exponent};
/// let roughness = perceptual_roughness_from_exponent(50.0);
/// assert!((roughness - 0.443).abs() < 0.001);
/// assert!((exponent_from_perceptual_roughness(roughness) - 50.0).abs() < 0.01);
/// ```
pub fn perceptual_roughness_from_exponent(exponent: f32) -> f32 {
    let exponent = if exponent > 0.0 { exponent.min(MAX_EXPONENT) } else { 0.0 };
    (2.0 / (exponent + 2.0)).sqrt().sqrt()
}

/// Exponent of the highlight of a surface with a perceptual roughness, 0…1 (clamped; NaN means 1), at most 100 000. The
/// reverse of [`perceptual_roughness_from_exponent`], with an example there.
pub fn exponent_from_perceptual_roughness(perceptual_roughness: f32) -> f32 {
    let roughness = if perceptual_roughness < 1.0 { perceptual_roughness.max(0.0) } else { 1.0 };
    let alpha = roughness * roughness;
    (2.0 / (alpha * alpha).max(f32::MIN_POSITIVE) - 2.0).min(MAX_EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    /// Steps of the integral over the hemisphere.
    const STEPS: u32 = 20_000;

    /// Density of microfacets along the normal if it is cosⁿ: 1 ÷ ∫ cosⁿ θ cos θ dω.
    fn density_along_normal(exponent: f32) -> f64 {
        let step = FRAC_PI_2 / f64::from(STEPS);
        let angles = (0..STEPS).map(|i| (f64::from(i) + 0.5) * step);
        1.0 / angles.map(|angle| angle.cos().powf(f64::from(exponent) + 1.0) * angle.sin() * TAU * step).sum::<f64>()
    }

    #[test]
    fn both_lobes_are_equally_high() {
        for roughness in [0.2_f32, 0.35, 0.5, 0.7, 0.9, 1.0] {
            // GGX has a density of 1 ÷ πα² along the normal.
            let expected = 1.0 / (PI * f64::from(roughness).powi(4));
            let density = density_along_normal(exponent_from_perceptual_roughness(roughness));
            assert!((density / expected - 1.0).abs() < 1e-3, "{roughness}: {density}, expected {expected}");
        }
    }

    #[test]
    fn both_ways_are_inverse_and_defined_everywhere() {
        for exponent in [0.0, 1.0, 10.0, 50.0, 1000.0, 1e5] {
            let back = exponent_from_perceptual_roughness(perceptual_roughness_from_exponent(exponent));
            assert!((back - exponent).abs() <= 1e-4 * exponent.max(1.0), "{exponent} → {back}");
        }
        assert_eq!([-1.0, f32::NAN].map(perceptual_roughness_from_exponent), [1.0; 2]);
        assert_eq!(perceptual_roughness_from_exponent(f32::INFINITY), perceptual_roughness_from_exponent(1e5));
        assert_eq!([1.0, 2.0, f32::NAN].map(exponent_from_perceptual_roughness), [0.0; 3]);
        assert_eq!([0.0, -1.0, 1e-30].map(exponent_from_perceptual_roughness), [1e5; 3]);
    }
}
