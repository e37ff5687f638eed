//! `StandardMaterial` whose light comes in flat bands.

use super::{SurfaceStyle, twin::StyleExtension};
use crate::shadows::{DomeShader, DomeTextures};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::{
        render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
        storage::ShaderBuffer,
    },
    shader::ShaderRef,
};

/// A `StandardMaterial` in flat bands of light.
pub type ToonMaterial = ExtendedMaterial<StandardMaterial, ToonShaded>;

/// What [`ToonMaterial`] adds to a `StandardMaterial`. Managed by the crate: use [`SurfaceStyle::Toon`].
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
#[bind_group_data(DomeShader)]
pub struct ToonShaded {
    #[texture(100, sample_type = "depth")]
    #[sampler(101, sampler_type = "comparison")]
    atlas: Handle<Image>,
    #[storage(102, read_only)]
    views: Handle<ShaderBuffer>,
    #[storage(103, read_only)]
    weights: Handle<ShaderBuffer>,
    #[storage(104, read_only)]
    visibility: Handle<ShaderBuffer>,
    shader: DomeShader,
    #[uniform(105)]
    uniform: ToonUniform,
}

/// Mirror of `Toon` in toon.wgsl.
#[derive(ShaderType, Clone, Copy, Debug)]
struct ToonUniform {
    bands: f32,
    highlight: f32,
}

impl From<&ToonShaded> for DomeShader {
    fn from(extension: &ToonShaded) -> Self {
        extension.shader
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
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader_defs.extend(key.bind_group_data.shader_defs());
        }
        Ok(())
    }
}

impl StyleExtension for ToonShaded {
    /// The number of bands, and whether there are highlights.
    type Parameters = (u32, bool);

    fn parameters(style: &SurfaceStyle, _: bool) -> Option<(u32, bool)> {
        match style {
            SurfaceStyle::Toon(toon) => Some((toon.clamped_bands(), toon.highlight)),
            _ => None,
        }
    }

    fn new((bands, highlight): (u32, bool), textures: &DomeTextures) -> Self {
        Self {
            atlas: textures.atlas.clone(),
            views: textures.views.clone(),
            weights: textures.weights.clone(),
            visibility: textures.visibility.clone(),
            shader: textures.shader,
            uniform: ToonUniform { bands: bands as f32, highlight: f32::from(highlight) },
        }
    }

    /// Bands are matte: without the layers that would show the room sharply, and without their cost.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        StandardMaterial {
            clearcoat: 0.0,
            anisotropy_strength: 0.0,
            specular_transmission: 0.0,
            diffuse_transmission: 0.0,
            ..base
        }
    }
}
