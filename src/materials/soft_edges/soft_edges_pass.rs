//! Pass that softens the edges of phantoms.

use super::{SoftPhantomEdges, prepare_soft_edges::PreparedSoftEdges, soft_edges_pipeline::SoftEdgesPipeline};
use bevy::{
    core_pipeline::prepass::ViewPrepassTextures,
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroupEntries, Operations, PipelineCache, RenderPassColorAttachment, RenderPassDescriptor,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::{ViewTarget, ViewUniformOffset, ViewUniforms},
    },
};

type SoftenedView =
    (&'static ViewTarget, &'static ViewPrepassTextures, &'static ViewUniformOffset, &'static PreparedSoftEdges);

pub(super) fn soft_edges_pass(
    view: ViewQuery<SoftenedView, With<SoftPhantomEdges>>,
    pipeline: Option<Res<SoftEdgesPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    view_uniforms: Res<ViewUniforms>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (target, prepass, view_offset, prepared) = view.into_inner();
    let (Some(layouts), Some(ready), Some(depths), Some(normals), Some(view_uniform), Some(uniform)) = (
        pipeline,
        pipeline_cache.get_render_pipeline(prepared.pipeline),
        prepass.depth_view(),
        prepass.normal_view(),
        view_uniforms.uniforms.binding(),
        prepared.uniform.binding(),
    ) else {
        return;
    };
    let post_process = target.post_process_write();
    let bind_group = device.create_bind_group(
        "mirrorball_soft_edges_bind_group",
        &pipeline_cache.get_bind_group_layout(layouts.layout(prepared.is_multisampled)),
        &BindGroupEntries::sequential((view_uniform, post_process.source, depths, normals, uniform)),
    );
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_soft_edges_pass"),
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
    let span = diagnostics.pass_span(&mut pass, "mirrorball_soft_edges");
    pass.set_render_pipeline(ready);
    pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
