//! Pass that gives virtual things the blur and the noise of the frame.

use super::{grain_pipeline::GrainPipeline, prepare_grain::PreparedGrain};
use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroupEntries, Operations, PipelineCache, RenderPassColorAttachment, RenderPassDescriptor,
        },
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
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_grain_pass"),
        color_attachments: &[Some(RenderPassColorAttachment {
            view: post_process.destination,
            depth_slice: None,
            resolve_target: None,
            ops: Operations::default(),
        })],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_grain");
    pass.set_render_pipeline(ready);
    pass.set_bind_group(0, &bind_group, &[]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
