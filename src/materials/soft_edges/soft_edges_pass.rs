//! Pass that softens the edges of phantoms.

use super::{SoftPhantomEdges, prepare_soft_edges::PreparedSoftEdges, soft_edges_pipeline::SoftEdgesPipeline};
use crate::materials::screen_pass::draw_over_view;
use bevy::{
    core_pipeline::prepass::ViewPrepassTextures,
    prelude::*,
    render::{
        render_resource::{BindGroupEntries, PipelineCache},
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
    draw_over_view(
        &mut ctx,
        post_process.destination,
        "mirrorball_soft_edges",
        ready,
        &bind_group,
        &[view_offset.offset],
    );
}
