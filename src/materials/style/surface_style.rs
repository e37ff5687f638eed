//! The choice of a look, per entity or per scene.

use bevy::prelude::*;

/// How a mesh, or everything below a spawned scene's root, is shaded. The nearest ancestor's style counts; it may
/// change at any time. Phantoms have no style.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// // a whole scene as a cartoon, in three bands with an outline
/// let robot = assets.load(GltfAssetLabel::Scene(0).from_asset("robot.glb"));
/// commands.spawn((WorldAssetRoot(robot), SurfaceStyle::Toon(default())));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum SurfaceStyle {
    /// Lit by the measured environment, with dome shadows on its diffuse light. What meshes without a style get.
    #[default]
    ImageBased,
    /// Flat bands of the room's light, and an outline.
    Toon(ToonStyle),
    /// Bevy's `StandardMaterial` untouched: lit by the environment, without dome shadows.
    Engine,
}

/// The details of [`SurfaceStyle::Toon`].
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
    /// Whether surfaces with a perceptual roughness below 0.75 have a hard-edged highlight where they would mirror the
    /// light. Defaults to `true`.
    pub highlight: bool,
    /// Width of the outline in physical pixels of the camera's viewport, whatever the distance; 0…64 (clamped), 0 or not
    /// a number is no outline. Defaults to 2.
    pub outline_width: f32,
    /// Color of the outline. It is not lit; an alpha below 1 has no effect. Defaults to black.
    pub outline_color: Color,
}

impl Default for ToonStyle {
    fn default() -> Self {
        Self { bands: 3, highlight: true, outline_width: 2.0, outline_color: Color::BLACK }
    }
}

impl ToonStyle {
    /// Most brightness steps a style can have.
    pub const MAX_BANDS: u32 = 5;
    /// Fewest brightness steps a style can have.
    pub const MIN_BANDS: u32 = 2;
    /// Widest outline in physical pixels.
    pub const MAX_OUTLINE_WIDTH: f32 = 64.0;

    /// The number of bands within its bounds.
    pub(in crate::materials) fn clamped_bands(&self) -> u32 {
        self.bands.clamp(Self::MIN_BANDS, Self::MAX_BANDS)
    }

    /// The width within its bounds, if there is an outline.
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
