//! `StandardMaterial` whose image-based light is shadowed by the dome.

use super::{SurfaceStyle, twin::StyleExtension};
use crate::shadows::{DomeShader, DomeTextures};
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::{
        render_resource::{AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError},
        storage::ShaderBuffer,
    },
    shader::ShaderRef,
};

/// A `StandardMaterial` under dome shadows.
pub type ImageBasedMaterial = ExtendedMaterial<StandardMaterial, DomeShadowed>;

/// What [`ImageBasedMaterial`] adds to a `StandardMaterial`. Managed by the crate.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
#[bind_group_data(DomeShader)]
pub struct DomeShadowed {
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
}

impl From<&DomeShadowed> for DomeShader {
    fn from(extension: &DomeShadowed) -> Self {
        extension.shader
    }
}

impl MaterialExtension for DomeShadowed {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/image_based.wgsl".into()
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

impl StyleExtension for DomeShadowed {
    type Parameters = ();

    fn parameters(style: &SurfaceStyle, has_dome: bool) -> Option<()> {
        (has_dome && *style == SurfaceStyle::ImageBased).then_some(())
    }

    fn new((): (), textures: &DomeTextures) -> Self {
        Self {
            atlas: textures.atlas.clone(),
            views: textures.views.clone(),
            weights: textures.weights.clone(),
            visibility: textures.visibility.clone(),
            shader: textures.shader,
        }
    }
}
