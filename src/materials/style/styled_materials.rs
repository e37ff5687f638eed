//! Styled materials: extensions of `StandardMaterial`s that draw a style, one for each original and set of parameters.

use super::SurfaceStyle;
use crate::{
    materials::neighbors::NeighborCubes,
    shadows::{DomeIdentity, DomeTextures},
};
use bevy::{
    material::OpaqueRendererMethod,
    pbr::{ExtendedMaterial, MaterialExtension},
    platform::collections::HashMap,
    prelude::*,
    render::storage::ShaderBuffer,
};
use std::hash::Hash;

/// Extension of `StandardMaterial` that draws a style.
pub(in crate::materials) trait StyleExtension: MaterialExtension {
    /// Parameters of the style that the extension depends on. Meshes with equal parameters and originals share a
    /// material.
    type Parameters: Copy + Eq + Hash + Send + Sync + 'static;

    /// Returns the parameters of a style, or `None` if another extension draws it.
    fn parameters(style: &SurfaceStyle, has_dome: bool) -> Option<Self::Parameters>;

    /// Returns the extension of an original, which is not simplified yet.
    fn new(
        parameters: Self::Parameters,
        original: &StandardMaterial,
        textures: &DomeTextures,
        neighbors: &NeighborCubes,
    ) -> Self;

    /// Removes the features of the original that the extension does not draw.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        base
    }
}

pub(super) type StyledMaterial<E> = ExtendedMaterial<StandardMaterial, E>;
pub(super) type StyledMaterialKey<E> = (AssetId<StandardMaterial>, <E as StyleExtension>::Parameters);

/// Styled materials in use, one for each original and set of parameters, so that meshes still batch. The meshes keep
/// the materials alive.
#[derive(Resource)]
pub(in crate::materials) struct StyledMaterials<E: StyleExtension> {
    pub(super) by_key: HashMap<StyledMaterialKey<E>, AssetId<StyledMaterial<E>>>,
    pub(super) made_with: Option<(DomeIdentity, AssetId<ShaderBuffer>)>,
}

impl<E: StyleExtension> Default for StyledMaterials<E> {
    fn default() -> Self {
        Self { by_key: HashMap::default(), made_with: None }
    }
}

/// Original material of a mesh with a styled material, and the parameters of its style.
#[derive(Component)]
pub(in crate::materials) struct Styled<E: StyleExtension> {
    pub(in crate::materials) original: Handle<StandardMaterial>,
    pub(super) parameters: E::Parameters,
}

/// Creates the styled material of an original. It is always drawn forward: the deferred pass has no shadows per color
/// channel.
pub(super) fn styled_material<E: StyleExtension>(
    original: &StandardMaterial,
    parameters: E::Parameters,
    textures: &DomeTextures,
    neighbors: &NeighborCubes,
) -> StyledMaterial<E> {
    let base = StandardMaterial { opaque_render_method: OpaqueRendererMethod::Forward, ..original.clone() };
    ExtendedMaterial { base: E::simplify(base), extension: E::new(parameters, original, textures, neighbors) }
}
