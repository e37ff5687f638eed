//! Surface style of an entity or a scene.

use super::{ClassicStyle, ToonStyle};
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
    /// Drawn with the original `StandardMaterial`: lit by the environment, without dome shadows. Without multisampling,
    /// Bevy 0.19.1 draws clear coats and anisotropy wrongly where there is a normal prepass, and a dome adds one; the
    /// other styles do not.
    Engine,
}

impl SurfaceStyle {
    pub(super) fn has_outline(&self) -> bool {
        matches!(self, Self::Toon(toon) if toon.visible_outline().is_some())
    }
}
