//! Extraction of camera frames, and bind groups for drawing them as backgrounds.

use super::{
    ArCamera, CameraFrame, FrameMapping, FrameTexture,
    background_pipeline::{BackgroundPipeline, BackgroundPipelineKey, BackgroundUniform},
};
use bevy::{
    prelude::*,
    render::{
        Extract,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, CachedRenderPipelineId, PipelineCache, SpecializedRenderPipelines,
            TextureViewId, UniformBuffer,
        },
        renderer::{RenderDevice, RenderQueue},
        sync_world::RenderEntity,
        texture::GpuImage,
        view::ExtractedView,
    },
};

/// Data with which a view draws the frame of its camera.
#[derive(Component)]
pub(super) struct ExtractedBackground {
    image: AssetId<Image>,
    frame_uv_from_view_uv: Vec4,
}

/// Pipeline and bind group of a view. Rebuilt only when their inputs change.
#[derive(Component)]
pub(super) struct PreparedBackground {
    pub(super) pipeline: CachedRenderPipelineId,
    pub(super) bind_group: BindGroup,
    made_from: (TextureViewId, BackgroundUniform),
}

type BackgroundSource = (RenderEntity, &'static ArCamera, &'static Camera, &'static CameraFrame, &'static FrameTexture);

pub(super) fn extract_backgrounds(mut commands: Commands, cameras: Extract<Query<BackgroundSource>>) {
    for (entity, ar_camera, camera, frame, texture) in &cameras {
        let Some(view_size) = camera.physical_viewport_size().filter(|size| size.min_element() > 0) else {
            continue;
        };
        let mapping = FrameMapping::new(ar_camera.fit, frame.pixels.size.as_vec2(), view_size.as_vec2());
        commands.entity(entity).insert(ExtractedBackground {
            image: texture.image.id(),
            frame_uv_from_view_uv: mapping.frame_uv_from_view_uv(),
        });
    }
}

type BackgroundView =
    (Entity, &'static ExtractedBackground, &'static ExtractedView, &'static Msaa, Option<&'static PreparedBackground>);

pub(super) fn prepare_backgrounds(
    mut commands: Commands,
    views: Query<BackgroundView>,
    pipeline: Res<BackgroundPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<BackgroundPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    for (entity, background, view, msaa, prepared) in &views {
        let Some(image) = images.get(background.image) else {
            continue;
        };
        let key = BackgroundPipelineKey { target_format: view.target_format, samples: msaa.samples() };
        let pipeline_id = pipelines.specialize(&pipeline_cache, &pipeline, key);
        let uniform = BackgroundUniform { frame_uv_from_view_uv: background.frame_uv_from_view_uv };
        let made_from = (image.texture_view.id(), uniform);
        if prepared.is_some_and(|p| p.pipeline == pipeline_id && p.made_from == made_from) {
            continue;
        }
        let mut buffer = UniformBuffer::from(uniform);
        buffer.set_label(Some("mirrorball_camera_background_uniform"));
        buffer.write_buffer(&device, &queue);
        let Some(binding) = buffer.binding() else {
            continue;
        };
        let bind_group = device.create_bind_group(
            "mirrorball_camera_background_bind_group",
            &pipeline_cache.get_bind_group_layout(&pipeline.layout),
            &BindGroupEntries::sequential((&image.texture_view, &image.sampler, binding)),
        );
        commands.entity(entity).insert(PreparedBackground { pipeline: pipeline_id, bind_group, made_from });
    }
}
