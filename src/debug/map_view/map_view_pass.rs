//! Pass that draws map views.

use super::{
    MapView,
    extract::ExtractedViews,
    map_view_pipeline::{MapViewPipeline, ShownUniform},
};
use crate::environment_map::cube_faces;
use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{BindGroupEntries, ComputePassDescriptor, PipelineCache, UniformBuffer},
        renderer::{RenderContext, RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Edge of a workgroup in threads, as in the shader.
const WORKGROUP: u32 = 8;

pub(super) fn map_view_pass(
    extracted: Res<ExtractedViews>,
    pipeline: Option<Res<MapViewPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
    mut ctx: RenderContext,
) {
    let Some(MapViewPipeline { layout, id }) = pipeline.as_deref() else { return };
    let Some(ready) = pipeline_cache.get_compute_pipeline(*id).filter(|_| !extracted.0.is_empty()) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_debug_map_view_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_debug_map_view");
    pass.set_pipeline(ready);
    for view in &extracted.0 {
        let (Some(map), Some(image)) = (images.get(view.map), images.get(view.image)) else {
            continue;
        };
        let last = map.texture.mip_level_count() - 1;
        let mut uniform = UniformBuffer::from(ShownUniform { level: view.shown.level.min(last), ..view.shown });
        uniform.set_label(Some("mirrorball_debug_map_view_uniform"));
        uniform.write_buffer(&device, &queue);
        let Some(binding) = uniform.binding() else { continue };
        let bind_group = device.create_bind_group(
            "mirrorball_debug_map_view_bind_group",
            &pipeline_cache.get_bind_group_layout(layout),
            &BindGroupEntries::sequential((&cube_faces(&map.texture), binding, &image.texture_view)),
        );
        pass.set_bind_group(0, &bind_group, &[]);
        pass.dispatch_workgroups(MapView::SIZE.x.div_ceil(WORKGROUP), MapView::SIZE.y.div_ceil(WORKGROUP), 1);
    }
    span.end(&mut pass);
}
