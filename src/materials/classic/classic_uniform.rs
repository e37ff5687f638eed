//! Coefficients of a classic style as the shader reads them.

use crate::materials::style::{ClassicModel, ClassicStyle, bounded, equal_by_numbers};
use bevy::{math::FloatOrd, render::render_resource::ShaderType};

/// Mirror of `Classic` in `classic.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(in crate::materials) struct ClassicUniform {
    ambient: f32,
    diffuse: f32,
    specular: f32,
    exponent: f32,
    reflection: f32,
    gloss_map: f32,
    roughness: f32,
    refraction: f32,
    perpendicular: f32,
    threshold: f32,
    measured_light: f32,
}

/// Value of `roughness` that stands for that of the surface.
const OF_SURFACE: f32 = -1.0;

/// Bounds a number that may be absent. Not a number counts as absent.
fn optional(number: Option<f32>, max: f32, absent: f32) -> f32 {
    number.filter(|number| !number.is_nan()).map_or(absent, |number| bounded(number, max))
}

impl ClassicUniform {
    /// Returns the coefficients of a style under a fraction of the measured light.
    pub(super) fn new(style: &ClassicStyle, measured_light: f32) -> Self {
        let coefficient = |number| bounded(number, ClassicStyle::MAX_COEFFICIENT);
        let fraction = |number| bounded(number, 1.0);
        let shared = Self {
            roughness: optional(style.roughness, 1.0, OF_SURFACE),
            refraction: optional(style.refraction, ClassicStyle::MAX_REFRACTION, 0.0),
            perpendicular: optional(style.fresnel, 1.0, 1.0),
            threshold: bounded(style.reflection_threshold, ClassicStyle::MAX_REFLECTION_THRESHOLD),
            measured_light,
            ..Self::default()
        };
        match style.model {
            ClassicModel::GlossMap => Self { diffuse: 1.0, reflection: 1.0, gloss_map: 1.0, ..shared },
            ClassicModel::Combined(model) => Self {
                ambient: coefficient(model.ambient),
                diffuse: coefficient(model.diffuse),
                specular: coefficient(model.specular),
                exponent: bounded(model.exponent, ClassicStyle::MAX_EXPONENT),
                reflection: coefficient(model.reflection),
                ..shared
            },
            ClassicModel::SphereMap(model) => {
                Self { diffuse: coefficient(model.diffuse), reflection: coefficient(model.mirror), ..shared }
            }
            ClassicModel::Mixed(model) => {
                let (base, diffuse) = (coefficient(model.base), fraction(model.diffuse));
                Self {
                    ambient: base * (1.0 - diffuse),
                    diffuse: base * diffuse,
                    reflection: fraction(model.mirror),
                    ..shared
                }
            }
        }
    }

    fn numbers(&self) -> ([FloatOrd; 6], [FloatOrd; 5]) {
        let Self { ambient, diffuse, specular, exponent, reflection, .. } = *self;
        let Self { gloss_map, roughness, refraction, perpendicular, threshold, measured_light, .. } = *self;
        let coefficients = [ambient, diffuse, specular, exponent, reflection, gloss_map];
        let options = [roughness, refraction, perpendicular, threshold, measured_light];
        (coefficients.map(FloatOrd), options.map(FloatOrd))
    }
}

equal_by_numbers!(ClassicUniform);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::style::{CombinedModel, MixedModel};

    #[test]
    fn what_is_out_of_range_is_clamped_and_not_a_number_is_nothing() {
        for (number, coefficient, absent) in [
            (f32::NAN, 0.0, 1.0),
            (-2.0, 0.0, 0.0),
            (0.5, 0.5, 0.5),
            (f32::INFINITY, ClassicStyle::MAX_COEFFICIENT, 1.0),
        ] {
            let model = CombinedModel {
                ambient: number,
                diffuse: number,
                specular: number,
                reflection: number,
                exponent: number,
            };
            let style = ClassicStyle {
                model: ClassicModel::Combined(model),
                fresnel: Some(number),
                reflection_threshold: number,
                ..ClassicStyle::default()
            };
            let uniform = ClassicUniform::new(&style, 1.0);
            let coefficients = [uniform.ambient, uniform.diffuse, uniform.specular, uniform.reflection];
            assert_eq!(coefficients, [coefficient; 4]);
            assert_eq!(uniform.perpendicular, absent);
            let (coefficients, options) = uniform.numbers();
            assert!(coefficients.iter().chain(&options).all(|number| number.0.is_finite()), "{uniform:?}");
        }
        let broken = ClassicStyle { roughness: Some(f32::NAN), refraction: Some(f32::NAN), ..ClassicStyle::default() };
        assert_eq!(ClassicUniform::new(&broken, 1.0), ClassicUniform::new(&ClassicStyle::default(), 1.0));
    }

    #[test]
    fn equal_styles_share_a_material_and_others_do_not() {
        let style = |diffuse| ClassicStyle {
            model: ClassicModel::Mixed(MixedModel { diffuse, ..MixedModel::default() }),
            ..ClassicStyle::default()
        };
        let uniform = |diffuse| ClassicUniform::new(&style(diffuse), 1.0);
        assert_eq!(uniform(1.0), uniform(5.0));
        assert_eq!(uniform(-0.0), uniform(0.0));
        assert_ne!(uniform(0.5), uniform(0.25));
    }
}
