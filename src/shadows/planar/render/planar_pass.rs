//! Draws the shadows of each changed receiver: per light a mask, its blur, and its share of the light.

use super::{
    blur_pipeline::BlurPipelines,
    prepare_planar::{LightDrawing, PlanarDrawing, PreparedPlanar},
    sky_pipeline::SkyPipeline,
};
use crate::{compute_pass::compute_pass, shadows::render::gpu::GpuAssets};
use bevy::{
    color::LinearRgba,
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{
            BindGroup, CachedRenderPipelineId, LoadOp, Operations, PipelineCache, RenderPassColorAttachment,
            RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, TextureView,
        },
        renderer::RenderContext,
    },
};

pub(super) fn planar_pass(
    mut prepared: ResMut<PreparedPlanar>,
    blur: Option<Res<BlurPipelines>>,
    sky: Option<Res<SkyPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    assets: GpuAssets,
    mut ctx: RenderContext,
) {
    let (Some(blur), Some(sky)) = (blur, sky) else {
        return;
    };
    for drawing in prepared.drawings.drain(..) {
        if let (Some(bind_group), Some(pipeline)) = (&drawing.sky, pipeline_cache.get_compute_pipeline(sky.weigh)) {
            compute_pass(&mut ctx, "mirrorball_shadows_planar_sky", |pass| {
                pass.set_bind_group(0, bind_group, &[]);
                pass.set_pipeline(pipeline);
                pass.dispatch_workgroups(1, 1, 1);
            });
        }
        let diagnostics = ctx.diagnostic_recorder();
        let diagnostics = diagnostics.as_deref();
        let span = diagnostics.time_span(ctx.command_encoder(), "mirrorball_shadows_planar");
        if drawing.lights.is_empty() {
            clear(&drawing.ratio, &mut ctx);
        }
        for (number, light) in drawing.lights.iter().enumerate() {
            draw_mask(&drawing, light, &pipeline_cache, &assets, &mut ctx);
            if let Some(across) = &light.across {
                draw_over(
                    &drawing.blurred,
                    Some(LinearRgba::NONE),
                    blur.blur_across,
                    across,
                    &pipeline_cache,
                    &mut ctx,
                );
            }
            let before = (number == 0).then_some(LinearRgba::WHITE);
            draw_over(&drawing.ratio, before, blur.take_share, &light.down, &pipeline_cache, &mut ctx);
        }
        span.end(ctx.command_encoder());
    }
}

/// Clears the target to a color, or keeps what is there.
fn color_attachment(view: &TextureView, clear: Option<LinearRgba>) -> Option<RenderPassColorAttachment<'_>> {
    let load = clear.map_or(LoadOp::Load, |color| LoadOp::Clear(color.into()));
    let ops = Operations { load, store: StoreOp::Store };
    Some(RenderPassColorAttachment { view, depth_slice: None, resolve_target: None, ops })
}

fn clear(ratio: &TextureView, ctx: &mut RenderContext) {
    drop(ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_shadows_planar_clear_pass"),
        color_attachments: &[color_attachment(ratio, Some(LinearRgba::WHITE))],
        ..default()
    }));
}

/// Adds up what is hidden from each point of a light.
fn draw_mask(
    drawing: &PlanarDrawing,
    light: &LightDrawing,
    pipeline_cache: &PipelineCache,
    assets: &GpuAssets,
    ctx: &mut RenderContext,
) {
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_shadows_planar_mask_pass"),
        color_attachments: &[color_attachment(&drawing.mask, Some(LinearRgba::NONE))],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &drawing.points,
            depth_ops: None,
            stencil_ops: Some(Operations { load: LoadOp::Clear(0), store: StoreOp::Discard }),
        }),
        ..default()
    });
    let Some(bind_group) = &drawing.bind_group else {
        return;
    };
    for (view, number) in light.views.clone().zip(1..) {
        pass.set_stencil_reference(number);
        for caster in &drawing.casters {
            let instance = caster.index * drawing.view_count + view;
            caster.draw(&mut pass, instance..instance + 1, bind_group, pipeline_cache, assets);
        }
    }
}

fn draw_over(
    target: &TextureView,
    clear: Option<LinearRgba>,
    pipeline: CachedRenderPipelineId,
    bind_group: &BindGroup,
    pipeline_cache: &PipelineCache,
    ctx: &mut RenderContext,
) {
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_shadows_planar_blur_pass"),
        color_attachments: &[color_attachment(target, clear)],
        ..default()
    });
    if let Some(pipeline) = pipeline_cache.get_render_pipeline(pipeline) {
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}
