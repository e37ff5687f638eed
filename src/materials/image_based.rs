//! Image-based material: a `StandardMaterial` whose image-based light is shadowed by the dome.

use super::{
    SurfaceStyle,
    dome_bindings::{DomeBindings, bind_fields, define_dome, define_in_fragment},
    neighbors::is_mirror,
    style::{MeshContext, SharedBindings, StyleExtension, equal_by_numbers},
};
use crate::shadows::DomeShader;
use bevy::{
    math::FloatOrd,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{ExtendedMaterial, MaterialExtension, MaterialExtensionKey, MaterialExtensionPipeline},
    prelude::*,
    render::render_resource::{AsBindGroup, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
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
    light: MeasuredBindings,
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

#[derive(AsBindGroup, Clone, Debug)]
struct MeasuredBindings {
    #[uniform(106)]
    uniform: MeasuredUniform,
}

/// Mirror of `Measured` in `image_based.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug)]
pub(super) struct MeasuredUniform {
    weight: f32,
}

impl MeasuredUniform {
    fn numbers(&self) -> FloatOrd {
        FloatOrd(self.weight)
    }
}

equal_by_numbers!(MeasuredUniform);

bind_fields!(DomeShadowed, ImageBasedKey, dome: DomeBindings, neighbors: NeighborBindings, light: MeasuredBindings);

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
    type Parameters = MeasuredUniform;

    /// Without a dome, the engine draws a surface that receives all light.
    fn parameters(style: &SurfaceStyle, context: MeshContext) -> Option<MeasuredUniform> {
        let weight = context.measured_light;
        let differs = context.has_dome || weight < 1.0;
        (differs && *style == SurfaceStyle::ImageBased).then_some(MeasuredUniform { weight })
    }

    fn new(uniform: MeasuredUniform, original: &StandardMaterial, shared: &SharedBindings) -> Self {
        Self {
            dome: shared.dome.as_ref().into(),
            light: MeasuredBindings { uniform },
            neighbors: NeighborBindings { cubes: shared.neighbors.buffer.clone() },
            is_mirror: shared.neighbors.has_mirrors() && is_mirror(original),
        }
    }
}
