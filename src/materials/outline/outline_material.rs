//! Material of outlines: one color, drawn on the far side of a hull.

use crate::{materials::dome_bindings::define_in_fragment, shadows::AlphaMask};
use bevy::{
    material::OpaqueRendererMethod,
    math::Affine2,
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
    #[texture(1)]
    #[sampler(2)]
    mask: Option<Handle<Image>>,
    key: OutlineKey,
}

/// Mirror of `Outline` in `outline.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug)]
struct OutlineUniform {
    color: Vec4,
    pixels: f32,
    meters: f32,
    alpha: f32,
    cutoff: f32,
    uv_transform: Mat3,
}

/// Pipeline key of outlines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(C)]
pub struct OutlineKey {
    /// Whether the outside of the hull faces away from the camera.
    is_inside_out: bool,
    is_masked: bool,
    /// Whether the mask lies on the second coordinates of textures.
    uses_second_uv: bool,
}

impl From<&OutlineMaterial> for OutlineKey {
    fn from(material: &OutlineMaterial) -> Self {
        material.key
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
        layout: &MeshVertexBufferLayoutRef,
        key: MaterialPipelineKey<Self>,
    ) -> Result<(), SpecializedMeshPipelineError> {
        let near_side = if key.bind_group_data.is_inside_out { Face::Back } else { Face::Front };
        descriptor.primitive.cull_mode = Some(near_side);
        let OutlineKey { is_masked, uses_second_uv, .. } = key.bind_group_data;
        let coordinates = if uses_second_uv { Mesh::ATTRIBUTE_UV_1 } else { Mesh::ATTRIBUTE_UV_0 };
        // As the surface, which ignores textures without coordinates.
        let is_masked = is_masked && layout.0.contains(coordinates);
        define_in_fragment(descriptor, is_masked.then(|| "MASKED".into()));
        define_in_fragment(descriptor, uses_second_uv.then(|| "MASK_UV_B".into()));
        Ok(())
    }
}

/// Appearance of an outline.
#[derive(Clone, PartialEq)]
pub(in crate::materials) struct OutlineLook {
    pub(super) color: LinearRgba,
    /// Widths in pixels and in meters, which add up.
    pub(super) widths: [f32; 2],
    pub(super) is_inside_out: bool,
    pub(super) mask: Option<AlphaMask>,
}

/// Hashable key of a look.
type LookKey = ([u32; 7], OutlineKey, Option<AssetId<Image>>, [u32; 9]);

impl OutlineLook {
    /// Returns a hashable key; equal looks have equal keys.
    pub(super) fn key(&self) -> LookKey {
        let OutlineMaterial { uniform, mask, key } = self.material();
        let OutlineUniform { color, pixels, meters, alpha, cutoff, uv_transform } = uniform;
        let numbers = [color.x, color.y, color.z, pixels, meters, alpha, cutoff].map(f32::to_bits);
        (numbers, key, mask.map(|mask| mask.id()), uv_transform.to_cols_array().map(f32::to_bits))
    }

    pub(super) fn material(&self) -> OutlineMaterial {
        let [pixels, meters] = self.widths;
        let mask = self.mask.as_ref();
        let uniform = OutlineUniform {
            color: self.color.to_vec4(),
            pixels,
            meters,
            alpha: mask.map_or(1.0, |mask| mask.alpha),
            cutoff: mask.map_or(0.0, |mask| mask.cutoff),
            uv_transform: mask.map_or(Affine2::IDENTITY, |mask| mask.uv_transform).into(),
        };
        let key = OutlineKey {
            is_inside_out: self.is_inside_out,
            is_masked: mask.is_some(),
            uses_second_uv: mask.is_some_and(|mask| mask.uses_second_uv),
        };
        OutlineMaterial { uniform, mask: mask.map(|mask| mask.texture.clone()), key }
    }
}

/// Outline materials in use, one for each look. The outlines keep the materials alive.
#[derive(Resource, Default)]
pub(in crate::materials) struct OutlineMaterials {
    pub(super) by_look: HashMap<LookKey, AssetId<OutlineMaterial>>,
}
