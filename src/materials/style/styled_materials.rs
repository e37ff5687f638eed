//! Styled materials: extensions of `StandardMaterial`s that draw a style, one for each original and set of parameters.

use super::SurfaceStyle;
use crate::{
    materials::{
        neighbors::NeighborCubes,
        strongest_light::StrongestLight,
        toon::{RampImages, RampPair},
    },
    shadows::{DomeIdentity, DomeTextures},
};
use bevy::{
    ecs::system::SystemParam,
    material::OpaqueRendererMethod,
    pbr::{ExtendedMaterial, MaterialExtension},
    platform::collections::HashMap,
    prelude::*,
    render::storage::ShaderBuffer,
};
use std::hash::Hash;

/// Textures and buffers that styled materials share.
#[derive(SystemParam)]
pub(in crate::materials) struct SharedBindings<'w> {
    pub(in crate::materials) dome: Res<'w, DomeTextures>,
    pub(in crate::materials) neighbors: Res<'w, NeighborCubes>,
    pub(in crate::materials) light: Res<'w, StrongestLight>,
    pub(in crate::materials) ramps: Res<'w, RampImages>,
}

/// Key of the shared bindings. Materials are remade when it changes.
pub(super) type BindingsIdentity = (DomeIdentity, AssetId<ShaderBuffer>);

impl SharedBindings<'_> {
    /// The buffer of the strongest light is always the same.
    pub(super) fn identity(&self) -> BindingsIdentity {
        (self.dome.identity(), self.neighbors.buffer.id())
    }
}

/// What the material of a mesh depends on beside its style. Shaders have no code for what the scene lacks.
#[derive(Clone, Copy, Debug)]
pub(in crate::materials) struct MeshContext {
    /// Whether the mesh is a copy that fades out.
    pub(in crate::materials) fades: bool,
    pub(in crate::materials) has_dome: bool,
    /// Whether there are lamps of the engine.
    pub(in crate::materials) has_lamps: bool,
    /// Fraction of the measured light that the mesh receives, 0…1.
    pub(in crate::materials) measured_light: f32,
    /// Ramps of toon surfaces.
    pub(in crate::materials) ramps: RampPair,
}

/// Extension of `StandardMaterial` that draws a style.
pub(in crate::materials) trait StyleExtension: MaterialExtension {
    /// Parameters of the style that the extension depends on. Meshes with equal parameters and originals share a
    /// material.
    type Parameters: Copy + Eq + Hash + Send + Sync + 'static;

    /// Returns the parameters of a style, or `None` if another extension draws it.
    fn parameters(style: &SurfaceStyle, context: MeshContext) -> Option<Self::Parameters>;

    /// Returns the extension of an original, which is not simplified yet, for meshes or for copies of them that fade
    /// out.
    fn new(parameters: Self::Parameters, fades: bool, original: &StandardMaterial, shared: &SharedBindings) -> Self;

    /// Removes the features of the original that the extension does not draw.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        base
    }
}

pub(super) type StyledMaterial<E> = ExtendedMaterial<StandardMaterial, E>;
/// What a styled material depends on beside its original: parameters of the style, and whether the mesh is a copy that
/// fades out.
pub(super) type Look<E> = (<E as StyleExtension>::Parameters, bool);
pub(super) type StyledMaterialKey<E> = (AssetId<StandardMaterial>, Look<E>);

/// Styled materials in use, one for each original and look, so that meshes still batch. The meshes keep
/// the materials alive.
#[derive(Resource)]
pub(in crate::materials) struct StyledMaterials<E: StyleExtension> {
    pub(super) by_key: HashMap<StyledMaterialKey<E>, AssetId<StyledMaterial<E>>>,
    pub(super) made_with: Option<BindingsIdentity>,
}

impl<E: StyleExtension> Default for StyledMaterials<E> {
    fn default() -> Self {
        Self { by_key: HashMap::default(), made_with: None }
    }
}

/// Original material of a mesh with a styled material, and its look.
#[derive(Component)]
pub(in crate::materials) struct Styled<E: StyleExtension> {
    pub(in crate::materials) original: Handle<StandardMaterial>,
    pub(super) look: Look<E>,
}

/// Creates the styled material of an original. It is always drawn forward: the deferred pass has no shadows per color
/// channel. Copies that fade out are blended over what replaces them.
pub(super) fn styled_material<E: StyleExtension>(
    original: &StandardMaterial,
    (parameters, fades): Look<E>,
    shared: &SharedBindings,
) -> StyledMaterial<E> {
    let base = StandardMaterial {
        opaque_render_method: OpaqueRendererMethod::Forward,
        alpha_mode: if fades { AlphaMode::Blend } else { original.alpha_mode },
        ..original.clone()
    };
    ExtendedMaterial { base: E::simplify(base), extension: E::new(parameters, fades, original, shared) }
}

/// Removes the layers that would mirror and transmit light in ways of their own, and their cost.
pub(in crate::materials) fn without_layers(base: StandardMaterial) -> StandardMaterial {
    StandardMaterial {
        clearcoat: 0.0,
        anisotropy_strength: 0.0,
        specular_transmission: 0.0,
        diffuse_transmission: 0.0,
        ..base
    }
}
