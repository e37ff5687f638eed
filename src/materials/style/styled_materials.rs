//! Materials that extend `StandardMaterial`s to draw a style, one per original and parameters.

use super::SurfaceStyle;
use crate::shadows::{DomeIdentity, DomeTextures};
use bevy::{
    material::OpaqueRendererMethod,
    pbr::{ExtendedMaterial, MaterialExtension},
    platform::collections::HashMap,
    prelude::*,
};
use std::hash::Hash;

/// An extension of `StandardMaterial` that draws a style.
pub(in crate::materials) trait StyleExtension: MaterialExtension {
    /// What of the style the extension depends on; meshes that agree in it share a twin.
    type Parameters: Copy + Eq + Hash + Send + Sync + 'static;

    /// `None` if this extension is not the one for the style.
    fn parameters(style: &SurfaceStyle, has_dome: bool) -> Option<Self::Parameters>;

    fn new(parameters: Self::Parameters, textures: &DomeTextures) -> Self;

    /// Takes away what the extension does not draw.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        base
    }
}

pub(super) type StyledMaterial<E> = ExtendedMaterial<StandardMaterial, E>;
pub(super) type StyledMaterialKey<E> = (AssetId<StandardMaterial>, <E as StyleExtension>::Parameters);

/// The twins in use; one per original and parameters, so that meshes still batch. The meshes that wear a twin keep it
/// alive.
#[derive(Resource)]
pub(in crate::materials) struct StyledMaterials<E: StyleExtension> {
    pub(super) by_key: HashMap<StyledMaterialKey<E>, AssetId<StyledMaterial<E>>>,
    pub(super) made_with: Option<DomeIdentity>,
}

impl<E: StyleExtension> Default for StyledMaterials<E> {
    fn default() -> Self {
        Self { by_key: HashMap::default(), made_with: None }
    }
}

/// On a mesh that wears a twin: where the twin comes from.
#[derive(Component)]
pub(in crate::materials) struct Styled<E: StyleExtension> {
    pub(in crate::materials) original: Handle<StandardMaterial>,
    pub(super) parameters: E::Parameters,
}

/// The twin of a material. Always drawn forward: the deferred pass knows no shadow per color channel.
pub(super) fn styled_material<E: StyleExtension>(
    original: &StandardMaterial,
    parameters: E::Parameters,
    textures: &DomeTextures,
) -> StyledMaterial<E> {
    let base = StandardMaterial { opaque_render_method: OpaqueRendererMethod::Forward, ..original.clone() };
    ExtendedMaterial { base: E::simplify(base), extension: E::new(parameters, textures) }
}
