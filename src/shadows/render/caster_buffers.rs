//! Transforms, joints and morph weights of all casters, as the depth pass reads them.

use super::{depth_pipeline::DepthPipelineKey, gpu::Gpu};
use crate::shadows::casters::Caster;
use bevy::{
    prelude::*,
    render::render_resource::{BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, Buffer, ShaderType},
};
use std::ops::Range;

/// Mirror of `Caster` in `caster.wgsl`.
#[derive(ShaderType, Clone, Copy, Default)]
struct CasterUniform {
    world_from_local: Mat4,
    uv_x: Vec4,
    uv_y: Vec4,
    kind: u32,
    first_joint: u32,
    first_morph_weight: u32,
    morph_targets: u32,
    first_vertex: u32,
    vertex_count: u32,
    first_morph_displacement: u32,
    cutoff: f32,
}

/// Everything the vertex shader reads of all casters.
#[derive(Default)]
pub(in crate::shadows) struct CasterBuffers {
    casters: Vec<CasterUniform>,
    joints: Vec<Mat4>,
    morph_weights: Vec<f32>,
}

impl CasterBuffers {
    /// Adds a caster and returns its index. `vertices` and `displacements` are the ranges of its mesh in Bevy's
    /// buffers.
    pub(in crate::shadows) fn push(
        &mut self,
        caster: &Caster,
        key: DepthPipelineKey,
        vertices: Range<u32>,
        displacements: Option<Range<u32>>,
    ) -> u32 {
        let mask = caster.alpha_mask.as_ref();
        let uv = mask.map_or(Mat3::IDENTITY, |mask| mask.uv_transform.into()).transpose();
        self.casters.push(CasterUniform {
            world_from_local: caster.world_from_local,
            uv_x: uv.x_axis.extend(0.0),
            uv_y: uv.y_axis.extend(0.0),
            kind: caster.is_phantom.into(),
            first_joint: self.joints.len() as u32,
            first_morph_weight: self.morph_weights.len() as u32,
            morph_targets: if key.is_morphed { caster.morph_weights.len() as u32 } else { 0 },
            first_vertex: vertices.start,
            vertex_count: vertices.end - vertices.start,
            first_morph_displacement: displacements.map_or(0, |range| range.start),
            cutoff: mask.map_or(0.0, |mask| mask.cutoff / mask.alpha.max(1e-6)),
        });
        self.joints.extend(&caster.joints);
        self.morph_weights.extend(&caster.morph_weights);
        self.casters.len() as u32 - 1
    }

    /// Writes the buffers and binds them together with the views and the directions to draw.
    pub(in crate::shadows) fn bind(
        self,
        views: &Buffer,
        refreshed: Vec<u32>,
        layout: &BindGroupLayoutDescriptor,
        gpu: &Gpu,
    ) -> Option<BindGroup> {
        let casters = gpu.storage_buffer("mirrorball_shadows_casters", self.casters, CasterUniform::default());
        let refreshed = gpu.storage_buffer("mirrorball_shadows_refreshed", refreshed, 0);
        let joints = gpu.storage_buffer("mirrorball_shadows_joints", self.joints, Mat4::ZERO);
        let morph_weights = gpu.storage_buffer("mirrorball_shadows_morph_weights", self.morph_weights, 0.0);
        let entries = BindGroupEntries::sequential((
            views.as_entire_binding(),
            casters.binding()?,
            refreshed.binding()?,
            joints.binding()?,
            morph_weights.binding()?,
        ));
        Some(gpu.bind_group("mirrorball_shadows_depth_bind_group", layout, &entries))
    }
}
