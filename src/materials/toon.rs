//! Toon material: a `StandardMaterial` shaded in flat bands of light.

use super::{
    SurfaceStyle,
    dome_bindings::{DomeBindings, bind_fields, define_dome},
    style::{SharedBindings, StyleExtension, without_layers},
};
use crate::shadows::DomeShader;
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
}

bind_fields!(ToonShaded, DomeShader, dome: DomeBindings, bands: ToonBindings);

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

impl From<&ToonShaded> for DomeShader {
    fn from(extension: &ToonShaded) -> Self {
        extension.dome.shader
    }
}

impl MaterialExtension for ToonShaded {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/toon.wgsl".into()
    }

    fn specialize(
        _: &MaterialExtensionPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialExtensionKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        define_dome(descriptor, key.bind_group_data, key.mesh_key);
        Ok(())
    }
}

impl StyleExtension for ToonShaded {
    /// Number of bands, and whether surfaces have highlights.
    type Parameters = (u32, bool);

    fn parameters(style: &SurfaceStyle, _: bool) -> Option<(u32, bool)> {
        match style {
            SurfaceStyle::Toon(toon) => Some((toon.clamped_bands(), toon.highlight)),
            _ => None,
        }
    }

    fn new((bands, highlight): (u32, bool), _: &StandardMaterial, shared: &SharedBindings) -> Self {
        let uniform = ToonUniform { bands: bands as f32, highlight: f32::from(highlight) };
        Self { dome: shared.dome.as_ref().into(), bands: ToonBindings { uniform } }
    }

    /// Bands are matte.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        without_layers(base)
    }
}
