//! Chooses the directions to draw and makes one draw call per caster.

use super::{
    caster_buffers::CasterBuffers,
    caster_draw::{CasterDraw, caster_draws},
    depth_pipeline::DepthPipelines,
    depth_pyramid_pipeline::DepthPyramidPipeline,
    extract::ExtractedDome,
    gpu::{Gpu, GpuAssets},
    prepare_views::DomeViews,
};
use crate::shadows::atlas::DomeTextures;
use bevy::{prelude::*, render::render_resource::BindGroup};
use std::iter::once;

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
    let DepthPipelines { shared, specialized } = &mut pipelines;
    let mut specialize = |key, layout: &_| specialized.specialize(&gpu.pipeline_cache, shared, key, layout);
    let draws = caster_draws(&dome.fitted.casters, &mut buffers, &mut specialize, shared, &assets, &gpu);
    let Ok(draws) = draws else {
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
