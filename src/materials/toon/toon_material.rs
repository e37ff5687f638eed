//! Toon material: a `StandardMaterial` shaded in flat bands of light.

use crate::{
    materials::{
        dome_bindings::{DomeBindings, bind_fields, define_dome, define_in_fragment},
        style::{SceneLight, SharedBindings, StyleExtension, SurfaceStyle, without_layers},
    },
    shadows::DomeShader,
};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
    shader::ShaderRef,
};

/// `StandardMaterial` shaded in flat bands of light.
pub type ToonMaterial = ExtendedMaterial<StandardMaterial, ToonShaded>;

/// Extension of `StandardMaterial` that makes a [`ToonMaterial`]. Managed by the crate: use [`SurfaceStyle::Toon`].
#[derive(Asset, TypePath, Clone, Debug)]
pub struct ToonShaded {
    dome: DomeBindings,
    bands: ToonBindings,
    has_lamps: bool,
}

bind_fields!(ToonShaded, ToonKey, dome: DomeBindings, bands: ToonBindings);

#[derive(AsBindGroup, Clone, Debug)]
struct ToonBindings {
    #[uniform(105)]
    uniform: ToonUniform,
}

/// Mirror of `Toon` in `toon.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug)]
struct ToonUniform {
    bands: f32,
    highlight: f32,
}

/// Permutation of the shader.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ToonKey {
    dome: DomeShader,
    /// Whether there are lamps of the engine. Without, the shader has no code for them.
    has_lamps: bool,
}

impl From<&ToonShaded> for ToonKey {
    fn from(extension: &ToonShaded) -> Self {
        Self { dome: extension.dome.shader, has_lamps: extension.has_lamps }
    }
}

impl MaterialExtension for ToonShaded {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/toon/toon.wgsl".into()
    }

    fn specialize(
        _: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let ToonKey { dome, has_lamps } = key.bind_group_data;
        define_dome(descriptor, dome, key.mesh_key);
        define_in_fragment(descriptor, has_lamps.then(|| "HAS_LAMPS".into()));
        Ok(())
    }
}

impl StyleExtension for ToonShaded {
    /// Number of bands, whether surfaces have highlights, and whether there are lamps.
    type Parameters = (u32, bool, bool);

    fn parameters(style: &SurfaceStyle, scene: SceneLight) -> Option<(u32, bool, bool)> {
        match style {
            SurfaceStyle::Toon(toon) => Some((toon.clamped_bands(), toon.highlight, scene.has_lamps)),
            _ => None,
        }
    }

    fn new((bands, highlight, has_lamps): (u32, bool, bool), _: &StandardMaterial, shared: &SharedBindings) -> Self {
        let uniform = ToonUniform { bands: bands as f32, highlight: f32::from(highlight) };
        Self { dome: shared.dome.as_ref().into(), bands: ToonBindings { uniform }, has_lamps }
    }

    /// Bands are matte.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        without_layers(base)
    }
}
