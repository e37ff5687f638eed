//! Settings of the toon style.

use super::numbers::bounded;
use bevy::{ecs::VariantDefaults, prelude::*};

/// Settings of [`SurfaceStyle::Toon`](super::SurfaceStyle::Toon): flat steps of light, and an outline.
///
/// The formulas are in the documentation of [`materials`](crate::materials#toon).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// let ink = ToonStyle { bands: 2, outline_width: 3.0, ..default() };
/// let style = SurfaceStyle::Toon(ink);
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct ToonStyle {
    /// Formula of the colors. Defaults to [`ToonModel::RoomLight`].
    pub model: ToonModel,
    /// Number of brightness steps from the dark to the lit side, 2…5 (clamped), where no [`ToonRamps`] say otherwise.
    /// Defaults to 3.
    ///
    /// [`ToonRamps`]: crate::materials::ToonRamps
    pub bands: u32,
    /// Light that the steps follow. Defaults to [`ToonKey::Prevailing`].
    pub key: ToonKey,
    /// Width of the transition between two bands, as a fraction of a band, 0…1 (clamped; NaN means 0): 0 for hard edges
    /// of light and shadow, one pixel wide, 1 for a gradient. Has no effect on ramps. Defaults to 0.
    pub softness: f32,
    /// Whether surfaces with a perceptual roughness below 0.75 show a hard-edged highlight where they would mirror the
    /// light. Defaults to `true`.
    pub highlight: bool,
    /// Strength of the rim light, 0…1 (clamped; NaN means 0): the light from behind a surface on a stripe along its
    /// silhouette. Defaults to 0, which is none.
    pub rim: f32,
    /// Width of the outline in physical pixels of the camera's viewport, 0…64 (clamped; NaN means 0): equally wide at
    /// any distance. Defaults to 2.
    pub outline_width: f32,
    /// Width of the outline in meters in the world, 0…1 (clamped; NaN means 0): thinner with distance, as if drawn on
    /// the object. It adds to the width in pixels, which then is the smallest one. Defaults to 0. Without either width
    /// there is no outline.
    pub outline_meters: f32,
    /// Color of the outline. It is unlit; alpha has no effect. Defaults to black.
    pub outline_color: Color,
}

impl Default for ToonStyle {
    fn default() -> Self {
        Self {
            model: ToonModel::RoomLight,
            bands: 3,
            key: ToonKey::Prevailing,
            softness: 0.0,
            highlight: true,
            rim: 0.0,
            outline_width: 2.0,
            outline_meters: 0.0,
            outline_color: Color::BLACK,
        }
    }
}

impl ToonStyle {
    /// Largest number of bands.
    pub const MAX_BANDS: u32 = 5;
    /// Smallest number of bands.
    pub const MIN_BANDS: u32 = 2;
    /// Largest factor of [`PhongToon`].
    pub const MAX_COEFFICIENT: f32 = 10.0;
    /// Largest exponent of [`PhongToon`].
    pub const MAX_EXPONENT: f32 = 1000.0;
    /// Largest width of an outline, in physical pixels.
    pub const MAX_OUTLINE_WIDTH: f32 = 64.0;
    /// Largest width of an outline, in meters.
    pub const MAX_OUTLINE_METERS: f32 = 1.0;

    /// Returns the number of bands, clamped to its bounds.
    pub(in crate::materials) fn clamped_bands(&self) -> u32 {
        self.bands.clamp(Self::MIN_BANDS, Self::MAX_BANDS)
    }

    /// Returns the widths of the outline in pixels and in meters, clamped to their bounds, or `None` if there is no
    /// outline.
    pub(in crate::materials) fn visible_outline(&self) -> Option<[f32; 2]> {
        let pixels = bounded(self.outline_width, Self::MAX_OUTLINE_WIDTH);
        let meters = bounded(self.outline_meters, Self::MAX_OUTLINE_METERS);
        (pixels + meters > 0.0).then_some([pixels, meters])
    }
}

/// Formula of the colors of a [`ToonStyle`].
#[derive(VariantDefaults, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ToonModel {
    /// Steps between the darkest and the brightest light of the room, in their colors.
    #[default]
    RoomLight,
    /// Kunze's formula (2006): ramps over N·L and (R·V)ⁿ. The room gives the direction of the light and the shadows,
    /// and neither brightness nor color.
    Phong(PhongToon),
}

/// Coefficients of [`ToonModel::Phong`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// let teapot = PhongToon { diffuse: 0.8, specular: 0.5, exponent: 30.0 };
/// let style = ToonStyle { model: ToonModel::Phong(teapot), ..default() };
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub struct PhongToon {
    /// Factor on base color × diffuse ramp, 0…10 (clamped; NaN means 0). Defaults to 1.
    pub diffuse: f32,
    /// Factor on the specular ramp, in frame buffer units, 0…10 (clamped; NaN means 0). Defaults to 0.5.
    pub specular: f32,
    /// Exponent n of the highlight, 0…1000 (clamped; NaN means 0): larger is smaller. Defaults to 20.
    pub exponent: f32,
}

impl Default for PhongToon {
    fn default() -> Self {
        Self { diffuse: 1.0, specular: 0.5, exponent: 20.0 }
    }
}

/// Light that the steps of a [`ToonStyle`] follow.
#[derive(VariantDefaults, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ToonKey {
    /// All light of the environment and the lamps together: the direction from which it prevails at each place.
    #[default]
    Prevailing,
    /// The strongest [`RealLight`](crate::lighting::RealLight); without one, as [`ToonKey::Prevailing`]. It turns by at
    /// most 8° a frame when another light becomes the strongest, and appears and vanishes over 8 frames.
    StrongestRealLight,
    /// A direction in world space, towards the light, of any length. Zero and directions that are not finite count as
    /// [`ToonKey::Prevailing`].
    Direction(Vec3),
}

impl ToonKey {
    /// Returns the author's direction as a unit vector, if there is one.
    pub(in crate::materials) fn authored_direction(&self) -> Option<Vec3> {
        match self {
            Self::Direction(direction) => direction.try_normalize(),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_out_of_range_is_clamped() {
        for (bands, expected) in [(0, 2), (2, 2), (4, 4), (5, 5), (1000, 5)] {
            assert_eq!(ToonStyle { bands, ..default() }.clamped_bands(), expected);
        }
        for (width, pixels, meters) in
            [(-1.0, 0.0, 0.0), (f32::NAN, 0.0, 0.0), (0.5, 0.5, 0.5), (3.0, 3.0, 1.0), (f32::INFINITY, 64.0, 1.0)]
        {
            let style = ToonStyle { outline_width: width, outline_meters: width, ..default() };
            assert_eq!(style.visible_outline(), (pixels > 0.0).then_some([pixels, meters]));
        }
        let in_meters = ToonStyle { outline_width: 0.0, outline_meters: 0.5, ..default() };
        assert_eq!(in_meters.visible_outline(), Some([0.0, 0.5]));
    }

    #[test]
    fn only_finite_directions_are_followed() {
        let direction = |x| ToonKey::Direction(Vec3::new(x, 0.0, 0.0)).authored_direction();
        assert_eq!([3.0, 0.0, f32::NAN, f32::INFINITY].map(direction), [Some(Vec3::X), None, None, None]);
    }
}
