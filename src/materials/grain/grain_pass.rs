//! Pass that gives virtual things the blur and the noise of the frame.

use super::{grain_pipeline::GrainPipeline, prepare_grain::PreparedGrain};
use crate::materials::screen_pass::draw_over_view;
use bevy::{
    prelude::*,
    render::{
        render_resource::{BindGroupEntries, PipelineCache},
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::ViewTarget,
    },
};

pub(super) fn grain_pass(
    view: ViewQuery<(&ViewTarget, &PreparedGrain)>,
    pipeline: Option<Res<GrainPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (target, prepared) = view.into_inner();
    let (Some(layouts), Some(ready), Some(uniform)) =
        (pipeline, pipeline_cache.get_render_pipeline(prepared.pipeline), prepared.uniform.binding())
    else {
        return;
    };
    let post_process = target.post_process_write();
    let bind_group = device.create_bind_group(
        "mirrorball_grain_bind_group",
        &pipeline_cache.get_bind_group_layout(&layouts.layout),
        &BindGroupEntries::sequential((post_process.source, &prepared.noise, uniform)),
    );
    draw_over_view(&mut ctx, post_process.destination, "mirrorball_grain", ready, &bind_group, &[]);
}
