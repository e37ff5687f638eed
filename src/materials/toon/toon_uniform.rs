//! Numbers of a toon style as the shader reads them.

use crate::materials::style::{ToonModel, ToonStyle, bounded, equal_by_numbers};
use bevy::{
    math::{FloatOrd, Vec3},
    render::render_resource::ShaderType,
};

/// Mirror of `Toon` in `toon_bindings.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, Default)]
pub(in crate::materials) struct ToonUniform {
    key_direction: Vec3,
    bands: f32,
    highlight: f32,
    max_dark: f32,
    edge_half_width: f32,
    rim: f32,
    diffuse: f32,
    specular: f32,
    exponent: f32,
    measured_light: f32,
}

/// Largest brightness of the dark color, as a fraction of the brightest light, for two bands and more. Neighboring
/// bands differ by at least 8 in CIEDE2000 if the brightest has a luminance of 0.18 and more, with four and five bands
/// 0.35.
const MAX_DARK: [f32; 4] = [0.45, 0.2, 0.1, 0.0];

impl ToonUniform {
    /// Returns the numbers of a style under a fraction of the measured light.
    pub(super) fn new(style: &ToonStyle, measured_light: f32) -> Self {
        let bands = style.clamped_bands();
        let kind = (bands - ToonStyle::MIN_BANDS) as usize;
        let shared = Self {
            key_direction: style.key.authored_direction().unwrap_or_default(),
            bands: bands as f32,
            highlight: f32::from(style.highlight),
            max_dark: MAX_DARK.get(kind).copied().unwrap_or_default(),
            edge_half_width: 0.5 * bounded(style.softness, 1.0),
            rim: bounded(style.rim, 1.0),
            measured_light,
            ..Self::default()
        };
        match style.model {
            ToonModel::RoomLight => shared,
            ToonModel::Phong(phong) => Self {
                diffuse: bounded(phong.diffuse, ToonStyle::MAX_COEFFICIENT),
                specular: bounded(phong.specular, ToonStyle::MAX_COEFFICIENT),
                exponent: bounded(phong.exponent, ToonStyle::MAX_EXPONENT),
                ..shared
            },
        }
    }

    fn numbers(&self) -> [FloatOrd; 12] {
        let Self { key_direction, bands, highlight, max_dark, edge_half_width, .. } = *self;
        let Self { rim, diffuse, specular, exponent, measured_light, .. } = *self;
        let [x, y, z] = key_direction.to_array();
        [x, y, z, bands, highlight, max_dark, edge_half_width, rim, diffuse, specular, exponent, measured_light]
            .map(FloatOrd)
    }

    /// Whether there is a rim light.
    pub(super) fn has_rim(&self) -> bool {
        self.rim > 0.0
    }
}

equal_by_numbers!(ToonUniform);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::materials::style::{PhongToon, ToonKey};
    use bevy::prelude::default;

    #[test]
    fn what_is_out_of_range_is_clamped_and_not_a_number_is_nothing() {
        for (number, coefficient, fraction) in
            [(f32::NAN, 0.0, 0.0), (-2.0, 0.0, 0.0), (0.5, 0.5, 0.5), (f32::INFINITY, 10.0, 1.0)]
        {
            let phong = PhongToon { diffuse: number, specular: number, exponent: number };
            let key = ToonKey::Direction(Vec3::splat(number));
            let style = ToonStyle { model: ToonModel::Phong(phong), softness: number, rim: number, key, ..default() };
            let uniform = ToonUniform::new(&style, 1.0);
            assert_eq!([uniform.diffuse, uniform.specular], [coefficient; 2]);
            assert_eq!([2.0 * uniform.edge_half_width, uniform.rim], [fraction; 2]);
            assert!(uniform.numbers().iter().all(|number| number.0.is_finite()), "{uniform:?}");
        }
    }

    #[test]
    fn equal_styles_share_a_material_and_others_do_not() {
        let uniform = |rim| ToonUniform::new(&ToonStyle { rim, ..default() }, 1.0);
        assert_eq!(uniform(1.0), uniform(5.0));
        assert_ne!(uniform(0.5), uniform(0.25));
    }
}
