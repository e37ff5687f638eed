//! Image-based material: a `StandardMaterial` whose image-based light is shadowed by the dome.

use super::{
    SurfaceStyle,
    dome_bindings::{DomeBindings, bind_fields, define_dome, define_in_fragment},
    neighbors::is_mirror,
    style::{SceneLight, SharedBindings, StyleExtension},
    toon::RampPair,
};
use crate::shadows::DomeShader;
use bevy::{
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, SpecializedMeshPipelineError},
    render::storage::ShaderBuffer,
    shader::ShaderRef,
};

/// `StandardMaterial` with dome shadows on its image-based light, which mirrors its neighbors.
pub type ImageBasedMaterial = ExtendedMaterial<StandardMaterial, DomeShadowed>;

/// Extension of `StandardMaterial` that makes an [`ImageBasedMaterial`]. Managed by the crate.
#[derive(Asset, TypePath, Clone, Debug)]
pub struct DomeShadowed {
    dome: DomeBindings,
    neighbors: NeighborBindings,
    is_mirror: bool,
}

/// Permutation of the shader.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ImageBasedKey {
    dome: DomeShader,
    /// Whether the surface is one that reflects its neighbors, and there are cubes with these. Without, the shader has
    /// no code for them.
    is_mirror: bool,
}

/// Binding of the cubes of all mirrors, as `neighbor_cubes.wgsl` declares it.
#[derive(AsBindGroup, Clone, Debug)]
struct NeighborBindings {
    #[storage(105, read_only, visibility(fragment))]
    cubes: Handle<ShaderBuffer>,
}

bind_fields!(DomeShadowed, ImageBasedKey, dome: DomeBindings, neighbors: NeighborBindings);

impl From<&DomeShadowed> for ImageBasedKey {
    fn from(extension: &DomeShadowed) -> Self {
        Self { dome: extension.dome.shader, is_mirror: extension.is_mirror }
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
        let ImageBasedKey { dome, is_mirror } = key.bind_group_data;
        define_dome(descriptor, dome, key.mesh_key);
        define_in_fragment(descriptor, is_mirror.then(|| "NEIGHBORS".into()));
        Ok(())
    }
}

impl StyleExtension for DomeShadowed {
    type Parameters = ();

    fn parameters(style: &SurfaceStyle, _: RampPair, scene: SceneLight) -> Option<()> {
        (scene.has_dome && *style == SurfaceStyle::ImageBased).then_some(())
    }

    fn new((): (), original: &StandardMaterial, shared: &SharedBindings) -> Self {
        Self {
            dome: shared.dome.as_ref().into(),
            neighbors: NeighborBindings { cubes: shared.neighbors.buffer.clone() },
            is_mirror: shared.neighbors.has_mirrors() && is_mirror(original),
        }
    }
}
