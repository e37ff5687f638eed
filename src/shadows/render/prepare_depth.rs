//! Chooses the directions to draw and makes one draw call per caster.

use super::{
    caster_buffers::CasterBuffers,
    depth_pipeline::{DepthPipelineKey, DepthPipelines, uv_attribute},
    depth_pyramid_pipeline::DepthPyramidPipeline,
    extract::ExtractedDome,
    gpu::{Gpu, GpuAssets},
    prepare_views::DomeViews,
};
use crate::shadows::{atlas::DomeTextures, casters::Caster};
use bevy::{
    mesh::{Mesh, PrimitiveTopology},
    prelude::*,
    render::render_resource::{BindGroup, BindGroupEntries, CachedRenderPipelineId},
};
use std::iter::once;

/// One caster's draw call.
pub(super) struct CasterDraw {
    /// Index in the buffer of casters.
    pub(super) index: u32,
    pub(super) mesh: AssetId<Mesh>,
    pub(super) pipeline: CachedRenderPipelineId,
    /// Morph displacements, then the texture of the alpha mask, as far as the pipeline has them.
    pub(super) bind_groups: Vec<BindGroup>,
}

/// What the depth pass draws in this frame.
#[derive(Resource, Default)]
pub(super) struct PreparedDepth {
    pub(super) bind_group: Option<BindGroup>,
    pub(super) draws: Vec<CasterDraw>,
    /// Directions and key lights to draw.
    pub(super) refreshed: Vec<u32>,
    /// Whether all shadow maps are drawn, so that the whole atlas can be cleared.
    pub(super) is_whole: bool,
}

/// A mesh or texture is not on the GPU yet.
struct NotLoaded;

/// Prepares the pending directions once all meshes, textures and pipelines are there. Until then they stay pending.
pub(super) fn prepare_depth(
    mut prepared: ResMut<PreparedDepth>,
    mut dome: ResMut<ExtractedDome>,
    mut views: ResMut<DomeViews>,
    textures: Option<Res<DomeTextures>>,
    mut pipelines: DepthPipelines,
    pyramids: Res<DepthPyramidPipeline>,
    assets: GpuAssets,
    gpu: Gpu,
) {
    prepared.bind_group = None;
    let Some(textures) = textures.filter(|textures| textures.layout.fits(&dome.fitted)) else {
        return;
    };
    let (Some(view_buffer), Some(_)) = (assets.buffers.get(&textures.views), assets.images.get(&textures.atlas)) else {
        return;
    };
    if dome.pending.is_empty() {
        return;
    }
    let mut buffers = CasterBuffers::default();
    let draws = dome
        .fitted
        .casters
        .iter()
        .filter_map(|caster| draw_of(caster, &mut buffers, &mut pipelines, &assets, &gpu).transpose());
    let Ok(draws) = draws.collect() else {
        return;
    };
    prepared.draws = draws;
    let is_compiled = |id| gpu.pipeline_cache.get_render_pipeline(id).is_some();
    if !is_compiled(pipelines.shared.clear) || !prepared.draws.iter().all(|draw| is_compiled(draw.pipeline)) {
        return;
    }
    if textures.layout.keys > 0 && gpu.pipeline_cache.get_compute_pipeline(pyramids.reduce).is_none() {
        return;
    }
    let refreshed = once(dome.pending.len() as u32).chain(dome.pending.iter().copied()).collect();
    let Some(bind_group) = buffers.bind(&view_buffer.buffer, refreshed, &pipelines.shared.layout, &gpu) else {
        return;
    };
    prepared.bind_group = Some(bind_group);
    let pending = std::mem::take(&mut dome.pending);
    views.refit(&dome.fitted, &textures.layout, &pending);
    prepared.is_whole = pending.len() as u32 == textures.layout.shadow_maps();
    prepared.refreshed = pending.into_iter().collect();
}

/// Returns a caster's draw call, or `None` for a mesh that cannot cast.
fn draw_of(
    caster: &Caster,
    buffers: &mut CasterBuffers,
    pipelines: &mut DepthPipelines,
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
    let pipeline = match pipelines.specialize(&gpu.pipeline_cache, key, &mesh.layout) {
        Ok(pipeline) => pipeline,
        Err(error) => {
            error_once!("a mesh cannot cast dome shadows: {error}");
            return Ok(None);
        }
    };
    let morph_bind_group = displacements.as_ref().map(|slice| {
        let entries = BindGroupEntries::single(slice.buffer.as_entire_binding());
        gpu.bind_group("mirrorball_shadows_depth_morph_bind_group", &pipelines.shared.morph_layout, &entries)
    });
    let mask_bind_group = mask_texture.map(|texture| {
        let entries = BindGroupEntries::sequential((&texture.texture_view, &texture.sampler));
        gpu.bind_group("mirrorball_shadows_depth_cutout_bind_group", &pipelines.shared.mask_layout, &entries)
    });
    Ok(Some(CasterDraw {
        index: buffers.push(caster, key, vertices.range, displacements.map(|slice| slice.range)),
        mesh: caster.mesh,
        pipeline,
        bind_groups: morph_bind_group.into_iter().chain(mask_bind_group).collect(),
    }))
}
