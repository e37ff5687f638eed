//! A render pass that draws one triangle over a whole view.

use bevy::render::{
    diagnostic::RecordDiagnostics,
    render_resource::{
        BindGroup, Operations, RenderPassColorAttachment, RenderPassDescriptor, RenderPipeline, TextureView,
    },
    renderer::RenderContext,
};

/// Draws over a view, timed under a name.
pub(super) fn draw_over_view(
    ctx: &mut RenderContext,
    view: &TextureView,
    name: &'static str,
    pipeline: &RenderPipeline,
    bind_group: &BindGroup,
    offsets: &[u32],
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some(name),
        color_attachments: &[Some(RenderPassColorAttachment {
            view,
            depth_slice: None,
            resolve_target: None,
            ops: Operations::default(),
        })],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, name);
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, bind_group, offsets);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
