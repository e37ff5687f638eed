//! Environment cube → irradiance and glossy maps, before all cameras: the plugin of the render world, and the pass.

use super::{
    filter::{Dispatch, ExtractedEnvironments, PreparedFilters, extract_environments, prepare_filters},
    pipeline::init_filter_pipelines,
};
use crate::{MirrorballPasses, environment_map::CubeWrites};
use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        render_resource::{
            CommandEncoder, ComputePassDescriptor, Extent3d, PipelineCache, TexelCopyTextureInfo, Texture,
        },
        renderer::{RenderContext, RenderGraph},
    },
};

pub(super) fn build(app: &mut App) {
    crate::trigonometry::load(app);
    crate::environment_map::load_shaders(app);
    embedded_asset!(app, "filter_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<ExtractedEnvironments>()
        .init_resource::<PreparedFilters>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, init_filter_pipelines)
        .add_systems(ExtractSchedule, extract_environments)
        .add_systems(Render, prepare_filters.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, filter_pass.in_set(MirrorballPasses::ReadCubes));
}

fn filter_pass(
    mut filters: ResMut<PreparedFilters>,
    writes: Res<CubeWrites>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for filter in filters.0.values_mut() {
        let due = (filter.progress.requested(), writes.count(filter.source));
        let is_ready = |dispatch: &Dispatch| pipeline_cache.get_compute_pipeline(dispatch.pipeline).is_some();
        if filter.next == 0 && (filter.answered == Some(due) || !filter.dispatches.iter().all(is_ready)) {
            continue;
        }
        let first = filter.next;
        let count = match first {
            0 => filter.budget.saturating_add(filter.capture - 1),
            _ => filter.budget,
        };
        let end = first.saturating_add(count).min(filter.dispatches.len());
        if first == 0 {
            filter.answered = Some(due);
        }
        let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
            label: Some("mirrorball_environment_filter_pass"),
            timestamp_writes: None,
        });
        let span = diagnostics.pass_span(&mut pass, "mirrorball_environment_filter");
        for dispatch in &filter.dispatches[first..end] {
            let Some(pipeline) = pipeline_cache.get_compute_pipeline(dispatch.pipeline) else {
                break;
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &dispatch.bind_group, &[]);
            pass.dispatch_workgroups(dispatch.groups.x, dispatch.groups.y, dispatch.groups.z);
        }
        span.end(&mut pass);
        drop(pass);
        filter.next = if end == filter.dispatches.len() { 0 } else { end };
        if filter.next == 0 {
            for (draft, shown) in &filter.publish {
                copy_levels(ctx.command_encoder(), draft, shown);
            }
            filter.progress.finish();
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
