//! Extraction of camera frames, and bind groups for drawing them as backgrounds.

use super::{
    ArCamera, CameraFrame, FrameMapping, FrameTexture, MarksReal,
    background_pipeline::{BackgroundPipeline, BackgroundPipelineKey, BackgroundUniform},
};
use bevy::{
    ecs::entity::EntityHashSet,
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
    marks_real: bool,
}

/// Pipeline and bind group of a view. Rebuilt only when their inputs change.
#[derive(Component)]
pub(super) struct PreparedBackground {
    pub(super) pipeline: CachedRenderPipelineId,
    pub(super) bind_group: BindGroup,
    made_from: (TextureViewId, BackgroundUniform),
}

type BackgroundSource =
    (RenderEntity, &'static ArCamera, &'static Camera, &'static CameraFrame, &'static FrameTexture, Has<MarksReal>);

pub(super) fn extract_backgrounds(
    mut commands: Commands,
    cameras: Extract<Query<BackgroundSource>>,
    extracted: Query<Entity, With<ExtractedBackground>>,
) {
    let mut current = EntityHashSet::default();
    for (entity, ar_camera, camera, frame, texture, marks_real) in &cameras {
        let mapping = FrameMapping::frame_uv_from_viewport_uv(camera, ar_camera.fit, frame.pixels.size);
        if let Some(frame_uv_from_view_uv) = mapping {
            let background = ExtractedBackground { image: texture.image.id(), frame_uv_from_view_uv, marks_real };
            commands.entity(entity).insert(background);
            current.insert(entity);
        }
    }
    // A camera that has lost its frame shows none.
    for entity in extracted.iter().filter(|entity| !current.contains(entity)) {
        commands.entity(entity).remove::<(ExtractedBackground, PreparedBackground)>();
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
        let (target_format, marks_real) = (view.target_format, background.marks_real);
        let key = BackgroundPipelineKey { target_format, samples: msaa.samples(), marks_real };
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
