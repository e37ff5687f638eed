//! Filters of the shadow maps, and the shader permutations that they need.

use bevy::{prelude::*, shader::ShaderDefVal};

/// Filter of the shadow maps. The numbers are those of the texels or lookups that are compared.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ShadowFilter {
    /// One texel: hard edges with visible steps.
    Nearest,
    /// 2 × 2 texels, weighted bilinearly.
    #[default]
    Bilinear,
    /// 3 × 3 texels with the weights 1 2 1, 2 4 2, 1 2 1, at subtexel positions.
    Gauss,
    /// Percentage-closer filtering: the mean of 3 × 3 bilinear lookups.
    Pcf9,
    /// The mean of 5 × 5 bilinear lookups.
    Pcf25,
    /// The mean of 7 × 7 bilinear lookups.
    Pcf49,
    /// Percentage-closer soft shadows (Fernando 2005): penumbras widen with the distance between receiver and blocker.
    Pcss {
        /// Half of the angle that the light subtends, in radians, above 0; clamped to 1.5, and 0 if not finite. The
        /// sun has 0.0047; 0.18 merges the shadows of 64 directions.
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

    /// Returns the radius of the filter in texels.
    pub(super) fn radius(self) -> u32 {
        match self {
            Self::Nearest | Self::Bilinear => 0,
            Self::Gauss | Self::Pcf9 | Self::Pcss { .. } => 1,
            Self::Pcf25 => 2,
            Self::Pcf49 => 3,
        }
    }

    /// Returns the tangent of the light's angular radius, 0 without one.
    pub(super) fn tangent_radius(self) -> f32 {
        match self {
            Self::Pcss { angular_radius } if angular_radius.is_finite() => angular_radius.clamp(0.0, 1.5).tan(),
            _ => 0.0,
        }
    }
}

/// Shader permutation key. Branching at run time instead would slow down software rasterizers, which pay for what
/// they skip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct DomeShader {
    pub(super) filter: FilterKind,
    /// Whether there are slots for key lights.
    pub(super) has_keys: bool,
    /// Whether some directions are in perspective, because their light is near. Key lights always may be.
    pub(super) has_perspective: bool,
    /// Whether there are samples of the visibility pass for every camera that has a depth and normal prepass.
    pub(crate) samples_prepass: bool,
}

impl DomeShader {
    /// Returns the shader definitions of `maps.wgsl` and `visibility.wgsl` for this permutation.
    pub(crate) fn shader_defs(self) -> impl Iterator<Item = ShaderDefVal> {
        let keys = self.has_keys.then(|| "KEY_LIGHTS".into());
        let spots = self.has_perspective.then(|| "SPOTS".into());
        [self.filter.shader_def(), keys, spots].into_iter().flatten()
    }
}

/// The part of a [`ShadowFilter`] that selects a shader permutation.
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
    /// A search for blockers, then bilinear lookups on a spiral.
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
