//! Shadow maps of key lights → depth pyramids, after the shadow maps are drawn and before all cameras.

use super::{depth_pyramid_pipeline::DepthPyramidPipeline, prepare_depth_pyramids::PreparedDepthPyramids};
use crate::compute_pass::compute_pass;
use bevy::{
    prelude::*,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

/// Workgroups along each axis: 8 × 8 blocks of the finest level each.
const WORKGROUPS: u32 = 8;

pub(super) fn depth_pyramid_pass(
    prepared: Res<PreparedDepthPyramids>,
    pipeline: Res<DepthPyramidPipeline>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(bind_group), Some(reduce)) = (&prepared.bind_group, pipeline_cache.get_compute_pipeline(pipeline.reduce))
    else {
        return;
    };
    compute_pass(&mut ctx, "mirrorball_shadows_depth_pyramid", |pass| {
        pass.set_bind_group(0, bind_group, &[]);
        pass.set_pipeline(reduce);
        pass.dispatch_workgroups(WORKGROUPS, WORKGROUPS, prepared.tile_count);
    });
}
