//! Settings of the classic styles.

use bevy::{ecs::VariantDefaults, prelude::*};

/// Settings of [`SurfaceStyle::Classic`](super::SurfaceStyle::Classic): image-based shading by sums of lookups in the
/// environment map, as games did it before physically based materials.
///
/// The formulas are in the documentation of [`materials`](crate::materials#classic-models).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// // lacquer that mirrors lamps only, more at grazing angles
/// let lacquer = ClassicStyle { fresnel: Some(0.04), reflection_threshold: 1.0, ..default() };
/// let style = SurfaceStyle::Classic(lacquer);
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ClassicStyle {
    /// Formula that mixes the terms. Defaults to [`ClassicModel::Combined`].
    pub model: ClassicModel,
    /// Perceptual roughness of the reflection, 0…1 (clamped), 0 for a sharp one;
    /// [`perceptual_roughness_from_exponent`](crate::materials::perceptual_roughness_from_exponent) converts exponents.
    /// `None` and NaN mean that of the `StandardMaterial`. Defaults to `None`.
    pub roughness: Option<f32>,
    /// Index of refraction outside ÷ inside, such as 0.95 for a thin bubble or 0.67 for glass: the environment is seen
    /// through the surface, bent once, instead of mirrored. At most 4 (clamped); at total reflection the surface
    /// mirrors. `None`, NaN, zero and negative values mean mirrored. Defaults to `None`.
    pub refraction: Option<f32>,
    /// Fraction of perpendicular light that is mirrored, 0…1 (clamped), 0.04 for plastics; it grows to 1 at grazing
    /// angles (Schlick 1994). `None` and NaN mean that all light is mirrored from all sides. Defaults to `None`.
    pub fresnel: Option<f32>,
    /// Brightness that is taken from the reflection, as a luminance in linear camera units, 0…1000 (clamped): with 1,
    /// a surface mirrors only what is brighter than the camera's white, such as lamps and windows. NaN means 0.
    /// Defaults to 0, which leaves all of the reflection.
    pub reflection_threshold: f32,
}

impl ClassicStyle {
    /// Largest coefficient of a term.
    pub const MAX_COEFFICIENT: f32 = 10.0;
    /// Largest exponent of a highlight.
    pub const MAX_EXPONENT: f32 = 1000.0;
    /// Largest threshold of the reflection.
    pub const MAX_REFLECTION_THRESHOLD: f32 = 1000.0;
    /// Largest ratio of refraction.
    pub const MAX_REFRACTION: f32 = 4.0;
}

/// Formula of a [`ClassicStyle`].
#[derive(VariantDefaults, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ClassicModel {
    /// Alpha of the base color is a gloss map: 1 is matte, 0 a mirror, both in the base color. With
    /// [`AlphaMode::Opaque`], as alpha has no other meaning then.
    GlossMap,
    /// Sum of ambient light, diffuse map, highlight of the strongest real light, and reflection.
    Combined(CombinedModel),
    /// A flat color that turns into the diffuse map, and the reflection on top of it.
    Mixed(MixedModel),
    /// Diffuse light and reflection straight from the ball in the camera frame, without environment maps.
    SphereMap(SphereMapModel),
}

impl Default for ClassicModel {
    fn default() -> Self {
        Self::Combined(default())
    }
}

/// Coefficients of [`ClassicModel::Combined`], each 0…10 (clamped; NaN means 0).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// let billiard_ball = CombinedModel { specular: 1.0, exponent: 200.0, reflection: 0.1, ..default() };
/// let style = ClassicStyle { model: ClassicModel::Combined(billiard_ball), ..default() };
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct CombinedModel {
    /// Light from everywhere, in linear camera units, that no shadow takes. Defaults to 0, because the diffuse map has
    /// the ambient light of the room.
    pub ambient: f32,
    /// Factor on the diffuse map. Defaults to 1: as bright as white paper at a white base color.
    pub diffuse: f32,
    /// Factor on the highlight of the strongest [`RealLight`](crate::lighting::RealLight). At 1, its brightest point
    /// shows what white paper facing the light does, times the color of the light. Defaults to 0.5.
    pub specular: f32,
    /// Factor on the reflection. Defaults to 0.1.
    pub reflection: f32,
    /// Exponent of the highlight, 0…1000 (clamped; NaN means 0): larger is smaller. Defaults to 50.
    pub exponent: f32,
}

impl Default for CombinedModel {
    fn default() -> Self {
        Self { ambient: 0.0, diffuse: 1.0, specular: 0.5, reflection: 0.1, exponent: 50.0 }
    }
}

/// Coefficients of [`ClassicModel::Mixed`]. With (diffuse, mirror) of (0, 0), surfaces are flat, (1, 0) are matte, and
/// (0, 1) mirror over a flat color.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct MixedModel {
    /// Factor on the base color, 0…10 (clamped; NaN means 0). Where no diffuse light is mixed in, a white surface shows
    /// this brightness. Defaults to 0.4.
    pub base: f32,
    /// Weight of the diffuse map, 0…1 (clamped; NaN means 0). Defaults to 0.7.
    pub diffuse: f32,
    /// Weight of the reflection, 0…1 (clamped; NaN means 0). Defaults to 0.5.
    pub mirror: f32,
}

impl Default for MixedModel {
    fn default() -> Self {
        Self { base: 0.4, diffuse: 0.7, mirror: 0.5 }
    }
}

/// Coefficients of [`ClassicModel::SphereMap`], each 0…10 (clamped; NaN means 0).
///
/// Surfaces show what the [`LightProbeSphere`](crate::probe::LightProbeSphere) does at the same normal, as seen from
/// the camera (Miller and Hoffman 1984), in the frame that was measured last. The ball needs to be in view; before it
/// was, surfaces are black. Clipped lamps have the [gain](crate::probe::ProbeMeasurement::gain) that the marker's paper
/// tells, nothing is remembered of what the ball does not show, and the reflection has 32 × 32 texels at most.
/// [`ClassicStyle::roughness`] and [`ClassicStyle::refraction`] have no effect.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// let enamel = SphereMapModel { diffuse: 0.8, mirror: 0.3 };
/// let style = ClassicStyle { model: ClassicModel::SphereMap(enamel), ..default() };
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct SphereMapModel {
    /// Factor on base color × diffuse light. Defaults to 1.
    pub diffuse: f32,
    /// Factor on the reflection. Defaults to 0.2.
    pub mirror: f32,
}

impl Default for SphereMapModel {
    fn default() -> Self {
        Self { diffuse: 1.0, mirror: 0.2 }
    }
}
