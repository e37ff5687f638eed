//! Surface style of an entity or a scene.

use super::ClassicStyle;
use bevy::{ecs::VariantDefaults, prelude::*};

/// Shading style of a mesh, or of all meshes below the root of a spawned scene.
///
/// The style of the nearest ancestor applies, the entity itself included. Styles may change at any time. Phantoms
/// ignore them.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// // a whole scene in toon style, with three bands and an outline
/// let robot = assets.load(GltfAssetLabel::Scene(0).from_asset("robot.glb"));
/// commands.spawn((WorldAssetRoot(robot), SurfaceStyle::Toon(default())));
/// # }
/// ```
#[derive(Component, VariantDefaults, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SurfaceStyle {
    /// Lit by the measured environment, with dome shadows on the image-based light. The style of meshes without a
    /// style.
    #[default]
    ImageBased,
    /// Shaded in flat bands of the room's light, with an outline.
    Toon(ToonStyle),
    /// Shaded by sums of lookups in the environment maps, as games did it before physically based materials.
    Classic(ClassicStyle),
    /// Drawn with the original `StandardMaterial`: lit by the environment, without dome shadows.
    Engine,
}

/// Settings of [`SurfaceStyle::Toon`].
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
    /// Number of brightness steps from the dark to the lit side, 2…5 (clamped). Defaults to 3.
    pub bands: u32,
    /// Whether surfaces with a perceptual roughness below 0.75 show a hard-edged highlight where they would mirror the
    /// light. Defaults to `true`.
    pub highlight: bool,
    /// Width of the outline in physical pixels of the camera's viewport, at any distance; 0…64 (clamped). Zero,
    /// negative values and NaN mean no outline. Defaults to 2.
    pub outline_width: f32,
    /// Color of the outline. It is unlit; alpha has no effect. Defaults to black.
    pub outline_color: Color,
}

impl Default for ToonStyle {
    fn default() -> Self {
        Self { bands: 3, highlight: true, outline_width: 2.0, outline_color: Color::BLACK }
    }
}

impl ToonStyle {
    /// Largest number of bands.
    pub const MAX_BANDS: u32 = 5;
    /// Smallest number of bands.
    pub const MIN_BANDS: u32 = 2;
    /// Largest width of an outline, in physical pixels.
    pub const MAX_OUTLINE_WIDTH: f32 = 64.0;

    /// Returns the number of bands, clamped to its bounds.
    pub(in crate::materials) fn clamped_bands(&self) -> u32 {
        self.bands.clamp(Self::MIN_BANDS, Self::MAX_BANDS)
    }

    /// Returns the width of the outline, clamped to its bounds, or `None` if there is no outline.
    pub(in crate::materials) fn visible_outline_width(&self) -> Option<f32> {
        (self.outline_width > 0.0).then(|| self.outline_width.min(Self::MAX_OUTLINE_WIDTH))
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
        for (outline_width, expected) in
            [(0.0, None), (-1.0, None), (f32::NAN, None), (0.5, Some(0.5)), (f32::INFINITY, Some(64.0))]
        {
            assert_eq!(ToonStyle { outline_width, ..default() }.visible_outline_width(), expected);
        }
    }
}
