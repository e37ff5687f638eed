//! Shape of the lobes of specular maps.

use bevy::{ecs::VariantDefaults, prelude::*};

/// Lobe with which the specular map of a [`LiveEnvironment`](super::LiveEnvironment) is filtered, around the mirrored
/// view.
#[derive(VariantDefaults, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SpecularLobe {
    /// GGX (Walter, Marschner, Li and Torrance 2007), as the engine's materials expect it: a bright middle with far
    /// tails. The default.
    #[default]
    Ggx,
    /// cosⁿ of the angle to the mirrored view, without tails: the gloss of classic image-based lighting (Miller and
    /// Hoffman 1984). [`SpecularLobe::exponent`] says which exponent goes with a roughness, and
    /// [`SpecularLobe::perceptual_roughness`] which roughness shows an exponent.
    Cosine,
}

impl SpecularLobe {
    /// Exponent n of [`SpecularLobe::Cosine`] at a perceptual roughness, 0…1 (clamped; NaN means 1): (1 ÷ α² + 1) ÷ 2
    /// with α the square of the roughness. From the mirror to the cosine, n = 1, at roughness 1, the lobe is about as
    /// wide as GGX.
    pub fn exponent(perceptual_roughness: f32) -> f32 {
        let roughness = if perceptual_roughness < 1.0 { perceptual_roughness.max(MIN_ROUGHNESS) } else { 1.0 };
        cosine_exponent(f64::from(roughness * roughness)) as f32
    }

    /// Perceptual roughness at which [`SpecularLobe::Cosine`] has an exponent: the reverse of
    /// [`SpecularLobe::exponent`]. Exponents below 1 and NaN count as 1.
    ///
    /// ```
    /// # use bevy_mirrorball::prelude::*;
    /// // a ball that mirrors through a lobe of cos⁵⁰, under an environment with SpecularLobe::Cosine
    /// let roughness = SpecularLobe::perceptual_roughness(50.0);
    /// assert!((roughness - 0.317).abs() < 0.001 && (SpecularLobe::exponent(roughness) - 50.0).abs() < 0.01);
    /// let style = SurfaceStyle::Classic(ClassicStyle { roughness: Some(roughness), ..Default::default() });
    /// ```
    pub fn perceptual_roughness(exponent: f32) -> f32 {
        let exponent = if exponent > 1.0 { exponent } else { 1.0 };
        (2.0 * exponent - 1.0).powf(-0.25).max(MIN_ROUGHNESS)
    }

    /// Kernel of the specular map by the angle to the light, not normalized.
    pub(super) fn kernel(self, alpha: f64, angle: f64) -> f64 {
        let cosine = angle.cos().max(0.0);
        match self {
            // The half vector bisects the angle, for normal = view.
            Self::Ggx => cosine / (0.5 * (1.0 + cosine) * (alpha * alpha - 1.0) + 1.0).powi(2),
            Self::Cosine => cosine.powf(cosine_exponent(alpha)),
        }
    }
}

/// Roughness below which surfaces are mirrors.
const MIN_ROUGHNESS: f32 = 0.01;

/// A lobe around the mirrored view is as wide as one of microfacets whose exponent, 2 ÷ α² − 2, is four times as large;
/// and the cosine of the light counts.
fn cosine_exponent(alpha: f64) -> f64 {
    0.5 / (alpha * alpha) + 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn both_ways_are_inverse_and_defined_everywhere() {
        for exponent in [1.0, 2.0, 50.0, 1000.0] {
            let back = SpecularLobe::exponent(SpecularLobe::perceptual_roughness(exponent));
            assert!((back / exponent - 1.0).abs() < 1e-4, "{exponent} → {back}");
        }
        assert_eq!([-3.0, 0.0, f32::NAN].map(SpecularLobe::perceptual_roughness), [1.0; 3]);
        assert_eq!([1.0, 2.0, f32::NAN].map(SpecularLobe::exponent), [1.0; 3]);
        assert!([0.0, -1.0].map(SpecularLobe::exponent).iter().all(|exponent| exponent.is_finite()));
        assert_eq!(SpecularLobe::perceptual_roughness(f32::INFINITY), MIN_ROUGHNESS);
    }

    #[test]
    fn half_of_both_lobes_is_within_similar_angles() {
        let median = |lobe: SpecularLobe, alpha: f64| {
            let angles: Vec<f64> = (0..10_000).map(|i| (f64::from(i) + 0.5) * FRAC_PI_2 / 1e4).collect();
            let weight = |angle: &f64| lobe.kernel(alpha, *angle) * angle.sin();
            let whole: f64 = angles.iter().map(weight).sum();
            let mut sum = 0.0;
            *angles
                .iter()
                .find(|angle| {
                    sum += weight(angle);
                    sum > 0.5 * whole
                })
                .expect("the sum reaches its half")
        };
        for alpha in [0.05, 0.2, 0.5, 1.0] {
            let [ggx, cosine] = [SpecularLobe::Ggx, SpecularLobe::Cosine].map(|lobe| median(lobe, alpha));
            println!("alpha {alpha}: {ggx}, {cosine}");
            assert!((0.75..1.34).contains(&(cosine / ggx)), "alpha {alpha}: {ggx} and {cosine}");
        }
    }
}
