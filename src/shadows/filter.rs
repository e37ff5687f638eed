//! How shadow maps are read.

use bevy::{prelude::*, shader::ShaderDefVal};

/// How shadow maps are read. The first five are those of row C3's sources, with the number of texels they compare.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum ShadowFilter {
    /// One texel: hard, with steps.
    Nearest,
    /// 2 × 2 texels, weighted by place.
    #[default]
    Bilinear,
    /// 3 × 3 texels with the weights 1 2 1, 2 4 2, 1 2 1, placed smoothly.
    Gauss,
    /// Percentage-closer filtering: the mean of 3 × 3 bilinear lookups.
    Pcf9,
    /// The mean of 5 × 5 bilinear lookups.
    Pcf25,
    /// The mean of 7 × 7 bilinear lookups.
    Pcf49,
    /// Percentage-closer soft shadows (Fernando 2005): as wide as the receiver is away from what blocks the light.
    Pcss {
        /// Half of the angle at which the light is seen, in radians above 0. The sun has 0.0047; 0.18 merges the shadows of
        /// 64 directions.
        angular_radius: f32,
    },
}

impl ShadowFilter {
    pub(super) fn kind(self) -> FilterKind {
        match self {
            Self::Nearest => FilterKind::Nearest,
            Self::Bilinear => FilterKind::Bilinear,
            Self::Gauss => FilterKind::Gauss,
            Self::Pcf9 | Self::Pcf25 | Self::Pcf49 => FilterKind::Pcf,
            Self::Pcss { .. } => FilterKind::Pcss,
        }
    }

    /// Texels around a place that are compared.
    pub(super) fn radius(self) -> u32 {
        match self {
            Self::Nearest | Self::Bilinear => 0,
            Self::Gauss | Self::Pcf9 | Self::Pcss { .. } => 1,
            Self::Pcf25 => 2,
            Self::Pcf49 => 3,
        }
    }

    /// Tangent of the light's angular radius.
    pub(super) fn tangent_radius(self) -> f32 {
        match self {
            Self::Pcss { angular_radius } if angular_radius.is_finite() => angular_radius.clamp(0.0, 1.5).tan(),
            _ => 0.0,
        }
    }
}

/// What needs shaders of its own, because software compilers of them pay for what they skip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct DomeShader {
    pub(super) filter: FilterKind,
    /// Whether there are places for key lights.
    pub(super) has_keys: bool,
    /// Whether light may come from near by.
    pub(super) has_perspective: bool,
}

impl DomeShader {
    /// The definitions under which `maps.wgsl` does that.
    pub(crate) fn shader_defs(self) -> impl Iterator<Item = ShaderDefVal> {
        let keys = self.has_keys.then(|| "KEY_LIGHTS".into());
        let spots = self.has_perspective.then(|| "SPOTS".into());
        [self.filter.shader_def(), keys, spots].into_iter().flatten()
    }
}

/// The part of a [`ShadowFilter`] that needs a shader of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) enum FilterKind {
    /// One texel.
    Nearest,
    /// One bilinear lookup.
    #[default]
    Bilinear,
    /// Four bilinear lookups.
    Gauss,
    /// A square of bilinear lookups.
    Pcf,
    /// A search for blockers, then a square of bilinear lookups.
    Pcss,
}

impl FilterKind {
    fn shader_def(self) -> Option<ShaderDefVal> {
        match self {
            Self::Nearest => Some("FILTER_NEAREST".into()),
            Self::Bilinear => None,
            Self::Gauss => Some("FILTER_GAUSS".into()),
            Self::Pcf => Some("FILTER_PCF".into()),
            Self::Pcss => Some("FILTER_PCSS".into()),
        }
    }
}
