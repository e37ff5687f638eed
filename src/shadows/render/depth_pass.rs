//! Draws casters into the tiles of all directions: one pass, one instanced draw per mesh.

use super::{depth_pipeline::DepthPipeline, gpu::GpuAssets, prepare_depth::PreparedDepth};
use crate::shadows::atlas::DomeTextures;
use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            LoadOp, Operations, PipelineCache, RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp,
            TextureView,
        },
        renderer::RenderContext,
    },
};

pub(super) fn depth_pass(
    mut prepared: ResMut<PreparedDepth>,
    textures: Option<Res<DomeTextures>>,
    depth_pipeline: Res<DepthPipeline>,
    pipeline_cache: Res<PipelineCache>,
    assets: GpuAssets,
    mut ctx: RenderContext,
) {
    let (Some(textures), Some(bind_group)) = (textures, prepared.bind_group.take()) else {
        return;
    };
    let (Some(atlas), Some(clear)) =
        (assets.images.get(&textures.atlas), pipeline_cache.get_render_pipeline(depth_pipeline.clear))
    else {
        return;
    };
    let directions = prepared.refreshed.len() as u32;
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let load = if prepared.is_whole { LoadOp::Clear(0.0) } else { LoadOp::Load };
    let mut pass = ctx.begin_tracked_render_pass(pass_descriptor(&atlas.texture_view, load));
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_depth");
    if !prepared.is_whole {
        pass.set_render_pipeline(clear);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..6, 0..2 * directions);
    }
    for draw in &prepared.draws {
        let instances = draw.index * directions..(draw.index + 1) * directions;
        draw.draw(&mut pass, instances, &bind_group, &pipeline_cache, &assets);
    }
    span.end(&mut pass);
}

fn pass_descriptor(atlas: &TextureView, load: LoadOp<f32>) -> RenderPassDescriptor<'_> {
    RenderPassDescriptor {
        label: Some("mirrorball_shadows_depth_pass"),
        color_attachments: &[],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: atlas,
            depth_ops: Some(Operations { load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    }
}
