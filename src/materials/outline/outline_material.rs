//! Material of outlines: one color, drawn on the far side of a hull.

use bevy::{
    material::OpaqueRendererMethod,
    mesh::MeshVertexBufferLayoutRef,
    pbr::{MaterialPipeline, MaterialPipelineKey},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{AsBindGroup, Face, RenderPipelineDescriptor, ShaderType, SpecializedMeshPipelineError},
    shader::ShaderRef,
};

/// Material of an outline. Managed by the crate: use
/// [`ToonStyle::outline_width`](crate::materials::ToonStyle::outline_width).
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
#[bind_group_data(OutlineKey)]
pub struct OutlineMaterial {
    #[uniform(0)]
    uniform: OutlineUniform,
    is_inside_out: bool,
}

/// Mirror of `Outline` in `outline.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug)]
struct OutlineUniform {
    color: Vec4,
    width: f32,
}

/// Pipeline key of outlines: the side of the hull that faces away from the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(C)]
pub struct OutlineKey {
    is_inside_out: bool,
}

impl From<&OutlineMaterial> for OutlineKey {
    fn from(material: &OutlineMaterial) -> Self {
        Self { is_inside_out: material.is_inside_out }
    }
}

impl Material for OutlineMaterial {
    fn vertex_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/outline/outline.wgsl".into()
    }

    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/outline/outline.wgsl".into()
    }

    fn opaque_render_method(&self) -> OpaqueRendererMethod {
        OpaqueRendererMethod::Forward
    }

    fn enable_prepass() -> bool {
        false
    }

    fn enable_shadows() -> bool {
        false
    }

    fn specialize(
        _: &MaterialPipeline,
        descriptor: &mut RenderPipelineDescriptor,
        _: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let near_side = if key.bind_group_data.is_inside_out { Face::Back } else { Face::Front };
        descriptor.primitive.cull_mode = Some(near_side);
        Ok(())
    }
}

/// Appearance of an outline.
#[derive(Clone, Copy, PartialEq)]
pub(in crate::materials) struct OutlineLook {
    pub(super) color: LinearRgba,
    pub(super) width: f32,
    pub(super) is_inside_out: bool,
}

impl OutlineLook {
    /// Returns a hashable key; equal looks have equal keys.
    pub(super) fn key(&self) -> ([u32; 4], bool) {
        let Self { color, width, is_inside_out } = *self;
        ([color.red, color.green, color.blue, width].map(f32::to_bits), is_inside_out)
    }

    pub(super) fn material(&self) -> OutlineMaterial {
        let uniform = OutlineUniform { color: self.color.to_vec4(), width: self.width };
        OutlineMaterial { uniform, is_inside_out: self.is_inside_out }
    }
}

/// Outline materials in use, one for each look. The outlines keep the materials alive.
#[derive(Resource, Default)]
pub(in crate::materials) struct OutlineMaterials {
    pub(super) by_look: HashMap<([u32; 4], bool), AssetId<OutlineMaterial>>,
}
