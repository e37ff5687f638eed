//! How much of the measured light surfaces receive.

use super::numbers::bounded;
use bevy::prelude::*;

/// Fraction of the measured light that all surfaces at and below an entity receive, 0…1 (clamped; NaN means 0).
/// Defaults to 1.
///
/// Measured light is that of the camera's environment map, with what virtual things bounce of it and mirrors show of
/// their neighbors, and [`RealLight`](crate::lighting::RealLight)s. At 0, surfaces are lit by the author's lamps and
/// ambient light only, and [`SurfaceStyle::Classic`], which does not know these, by its own coefficients.
/// [`SurfaceStyle::Engine`] receives all of the measured light, whatever this says, and phantoms are no surfaces of
/// this kind. Emissive and transmitted light stay as they are.
///
/// The weight of the nearest ancestor applies, the entity itself included. It may change in every frame; meshes with
/// equal materials, styles and weights are drawn together.
///
/// [`SurfaceStyle::Classic`]: super::SurfaceStyle::Classic
/// [`SurfaceStyle::Engine`]: super::SurfaceStyle::Engine
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands, assets: Res<AssetServer>) {
/// // a ghost that the room lights a little, and its own lantern fully
/// let ghost = assets.load(GltfAssetLabel::Scene(0).from_asset("ghost.glb"));
/// commands.spawn((WorldAssetRoot(ghost), MeasuredLightWeight(0.2)));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct MeasuredLightWeight(pub f32);

impl Default for MeasuredLightWeight {
    fn default() -> Self {
        Self(1.0)
    }
}

impl MeasuredLightWeight {
    /// Returns the weight, clamped to its bounds.
    pub(in crate::materials) fn clamped(self) -> f32 {
        bounded(self.0, 1.0)
    }
}
