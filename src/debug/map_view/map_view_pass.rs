//! Pass that draws map views.

use super::{
    MapView,
    extract::ExtractedViews,
    map_view_pipeline::{MapViewPipeline, ShownUniform},
};
use crate::{
    compute_pass::{compute_pass, workgroups},
    environment_map::cube_faces,
};
use bevy::{
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{BindGroupEntries, PipelineCache, UniformBuffer},
        renderer::{RenderContext, RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

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
    compute_pass(&mut ctx, "mirrorball_debug_map_view", |pass| {
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
            pass.dispatch_workgroups(workgroups(MapView::SIZE.x), workgroups(MapView::SIZE.y), 1);
        }
    });
}
