//! Draw calls of casters, for all that draws their shadows.

use super::{
    caster_buffers::CasterBuffers,
    depth_pipeline::{DepthPipeline, DepthPipelineKey, uv_attribute},
    gpu::{Gpu, GpuAssets},
};
use crate::shadows::casters::Caster;
use bevy::{
    mesh::{Mesh, MeshVertexBufferLayoutRef, PrimitiveTopology},
    prelude::*,
    render::{
        mesh::RenderMeshBufferInfo,
        render_phase::TrackedRenderPass,
        render_resource::{
            BindGroup, BindGroupEntries, CachedRenderPipelineId, PipelineCache, SpecializedMeshPipelineError,
        },
    },
};
use std::ops::Range;

/// One caster's draw call.
pub(in crate::shadows) struct CasterDraw {
    /// Index in the buffer of casters.
    pub(in crate::shadows) index: u32,
    pub(in crate::shadows) mesh: AssetId<Mesh>,
    pub(in crate::shadows) pipeline: CachedRenderPipelineId,
    /// Morph displacements, then the texture of the alpha mask, as far as the pipeline has them.
    pub(in crate::shadows) bind_groups: Vec<BindGroup>,
}

/// A mesh or texture is not on the GPU yet.
pub(in crate::shadows) struct NotLoaded;

/// Returns the pipeline for a kind of caster.
type Specialize<'a> = &'a mut dyn FnMut(
    DepthPipelineKey,
    &MeshVertexBufferLayoutRef,
) -> Result<CachedRenderPipelineId, SpecializedMeshPipelineError>;

/// Returns the draw calls of casters and writes what the vertex shader reads of them.
pub(in crate::shadows) fn caster_draws(
    casters: &[Caster],
    buffers: &mut CasterBuffers,
    specialize: Specialize,
    layouts: &DepthPipeline,
    assets: &GpuAssets,
    gpu: &Gpu,
) -> Result<Vec<CasterDraw>, NotLoaded> {
    let draws = casters.iter().filter_map(|c| draw_of(c, buffers, specialize, layouts, assets, gpu).transpose());
    draws.collect()
}

/// Returns a caster's draw call, or `None` for a mesh that cannot cast.
fn draw_of(
    caster: &Caster,
    buffers: &mut CasterBuffers,
    specialize: Specialize,
    layouts: &DepthPipeline,
    assets: &GpuAssets,
    gpu: &Gpu,
) -> Result<Option<CasterDraw>, NotLoaded> {
    let mesh = assets.meshes.get(caster.mesh).ok_or(NotLoaded)?;
    let vertices = assets.allocator.mesh_vertex_slice(&caster.mesh).ok_or(NotLoaded)?;
    if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
        warn_once!("only meshes of triangle lists cast dome shadows; one of {:?} does not", mesh.primitive_topology());
        return Ok(None);
    }
    let has = |attribute| mesh.layout.0.contains(attribute);
    let displacements =
        assets.allocator.mesh_morph_target_slice(&caster.mesh).filter(|_| !caster.morph_weights.is_empty());
    let mask = caster.alpha_mask.as_ref().filter(|mask| has(uv_attribute(mask.uses_second_uv)));
    let mask_texture = mask.map(|mask| assets.images.get(&mask.texture).ok_or(NotLoaded)).transpose()?;
    let key = DepthPipelineKey {
        is_skinned: !caster.joints.is_empty() && has(Mesh::ATTRIBUTE_JOINT_INDEX) && has(Mesh::ATTRIBUTE_JOINT_WEIGHT),
        is_morphed: displacements.is_some(),
        is_alpha_masked: mask_texture.is_some(),
        uses_second_uv: mask.is_some_and(|mask| mask.uses_second_uv),
    };
    let pipeline = match specialize(key, &mesh.layout) {
        Ok(pipeline) => pipeline,
        Err(error) => {
            error_once!("a mesh cannot cast dome shadows: {error}");
            return Ok(None);
        }
    };
    let morph_bind_group = displacements.as_ref().map(|slice| {
        let entries = BindGroupEntries::single(slice.buffer.as_entire_binding());
        gpu.bind_group("mirrorball_shadows_depth_morph_bind_group", &layouts.morph_layout, &entries)
    });
    let mask_bind_group = mask_texture.map(|texture| {
        let entries = BindGroupEntries::sequential((&texture.texture_view, &texture.sampler));
        gpu.bind_group("mirrorball_shadows_depth_cutout_bind_group", &layouts.mask_layout, &entries)
    });
    Ok(Some(CasterDraw {
        index: buffers.push(caster, key, vertices.range, displacements.map(|slice| slice.range)),
        mesh: caster.mesh,
        pipeline,
        bind_groups: morph_bind_group.into_iter().chain(mask_bind_group).collect(),
    }))
}

impl CasterDraw {
    /// Draws instances of the caster. What an instance is, the shader says.
    pub(in crate::shadows) fn draw<'p>(
        &'p self,
        pass: &mut TrackedRenderPass<'p>,
        instances: Range<u32>,
        bind_group: &'p BindGroup,
        pipeline_cache: &'p PipelineCache,
        assets: &'p GpuAssets,
    ) {
        let (Some(mesh), Some(pipeline), Some(vertices)) = (
            assets.meshes.get(self.mesh),
            pipeline_cache.get_render_pipeline(self.pipeline),
            assets.allocator.mesh_vertex_slice(&self.mesh),
        ) else {
            return;
        };
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        for (group, bound) in (1..).zip(&self.bind_groups) {
            pass.set_bind_group(group, bound, &[]);
        }
        pass.set_vertex_buffer(0, vertices.buffer.slice(..));
        match &mesh.buffer_info {
            RenderMeshBufferInfo::Indexed { index_format, count } => {
                if let Some(indices) = assets.allocator.mesh_index_slice(&self.mesh) {
                    let range = indices.range.start..indices.range.start + count;
                    pass.set_index_buffer(indices.buffer.slice(..), *index_format);
                    pass.draw_indexed(range, vertices.range.start as i32, instances);
                }
            }
            RenderMeshBufferInfo::NonIndexed => pass.draw(vertices.range.clone(), instances),
        }
    }
}
