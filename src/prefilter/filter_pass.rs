//! Compute pass that filters environments, before all cameras.

use super::{dispatch::Dispatch, prepare_filters::PreparedFilters};
use crate::{compute_pass::compute_pass, environment_map::CubeWrites};
use bevy::{
    prelude::*,
    render::{
        render_resource::{CommandEncoder, Extent3d, PipelineCache, TexelCopyTextureInfo, Texture},
        renderer::RenderContext,
    },
};

pub(super) fn filter_pass(
    mut filters: ResMut<PreparedFilters>,
    writes: Res<CubeWrites>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    for plan in filters.0.values_mut() {
        let due = (plan.progress.requested(), writes.count(plan.source));
        let is_ready = |dispatch: &Dispatch| pipeline_cache.get_compute_pipeline(dispatch.pipeline).is_some();
        if plan.next == 0 && (plan.answered == Some(due) || !plan.dispatches.iter().all(is_ready)) {
            continue;
        }
        let first = plan.next;
        let end = plan.end_of_frame();
        if first == 0 {
            plan.answered = Some(due);
        }
        compute_pass(&mut ctx, "mirrorball_environment_filter", |pass| {
            for dispatch in &plan.dispatches[first..end] {
                let Some(pipeline) = pipeline_cache.get_compute_pipeline(dispatch.pipeline) else {
                    break;
                };
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &dispatch.bind_group, &[]);
                pass.dispatch_workgroups(dispatch.groups.x, dispatch.groups.y, dispatch.groups.z);
            }
        });
        plan.next = if end == plan.dispatches.len() { 0 } else { end };
        if plan.next == 0 {
            for (draft, shown) in &plan.publish {
                copy_levels(ctx.command_encoder(), draft, shown);
            }
            plan.progress.finish();
        }
    }
}

fn copy_levels(encoder: &mut CommandEncoder, from: &Texture, to: &Texture) {
    for mip_level in 0..from.mip_level_count() {
        let edge = from.width() >> mip_level;
        encoder.copy_texture_to_texture(
            TexelCopyTextureInfo { mip_level, ..from.as_image_copy() },
            TexelCopyTextureInfo { mip_level, ..to.as_image_copy() },
            Extent3d { width: edge, height: edge, depth_or_array_layers: 6 },
        );
    }
}
