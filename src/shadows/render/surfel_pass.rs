//! Lights the surfels, after the shadow maps are drawn and the environment's light is summed, before all cameras.

use super::{
    prepare_surfels::PreparedSurfels, prepare_views::DomeViews, prepare_visibility::PreparedVisibility,
    prepare_weights::PreparedWeights, visibility_pipeline::DOME_GROUP,
};
use crate::{
    compute_pass::compute_pass,
    shadows::atlas::{DomeTextures, LIT_BYTES, LIT_OFFSET},
};
use bevy::{
    prelude::*,
    render::{
        render_asset::RenderAssets, render_resource::PipelineCache, renderer::RenderContext, storage::GpuShaderBuffer,
    },
};

/// Threads of a workgroup, as in the shader.
const THREADS: u32 = 64;

pub(super) fn surfel_pass(
    mut prepared: ResMut<PreparedSurfels>,
    mut views: ResMut<DomeViews>,
    visibility: Res<PreparedVisibility>,
    weights: Res<PreparedWeights>,
    textures: Option<Res<DomeTextures>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let has_changed = prepared.is_new || views.redrawn.all || !views.redrawn.indices.is_empty();
    if !has_changed && prepared.lit_by == Some(weights.sums) {
        return;
    }
    let pipelines: Option<Vec<_>> =
        prepared.pipelines.iter().map(|pipeline| pipeline_cache.get_compute_pipeline(*pipeline)).collect();
    let (
        Some(bind_group),
        Some(dome_bind_group),
        Some(results),
        Some(lit),
        Some([receive, estimate, send, receive_bounced]),
    ) = (
        &prepared.bind_group,
        &visibility.dome_bind_group,
        textures.and_then(|textures| buffers.get(&textures.results)),
        prepared.lit(),
        pipelines.as_deref(),
    )
    else {
        return;
    };
    let groups = prepared.count.div_ceil(THREADS);
    compute_pass(&mut ctx, "mirrorball_shadows_surfels", |pass| {
        pass.set_bind_group(0, bind_group, &[]);
        pass.set_bind_group(DOME_GROUP, dome_bind_group, &[]);
        for receive in [receive, receive_bounced] {
            pass.set_pipeline(receive);
            pass.dispatch_workgroups(groups, 1, 1);
            pass.set_pipeline(estimate);
            pass.dispatch_workgroups(prepared.phantoms, 1, 1);
            pass.set_pipeline(send);
            pass.dispatch_workgroups(groups.max(1), 1, 1);
        }
    });
    ctx.command_encoder().copy_buffer_to_buffer(lit, 0, &results.buffer, LIT_OFFSET as u64, LIT_BYTES as u64);
    (prepared.is_new, prepared.lit_by) = (false, Some(weights.sums));
    views.redrawn.surfels = true;
}
