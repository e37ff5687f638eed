//! Draws the camera picture behind everything, before the opaque pass and without touching depth.

use super::{ArCamera, CameraFrame, FrameMapping, FrameTexture};
use bevy::{
    asset::{embedded_asset, io::embedded::EmbeddedAssetRegistry, load_embedded_asset},
    core_pipeline::{Core3d, Core3dSystems, FullscreenShader, core_3d::main_opaque_pass_3d},
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
            ColorTargetState, ColorWrites, FragmentState, MultisampleState, PipelineCache, RenderPassDescriptor,
            RenderPipelineDescriptor, SamplerBindingType, ShaderStages, ShaderType, SpecializedRenderPipeline,
            SpecializedRenderPipelines, TextureFormat, TextureSampleType, TextureViewId, UniformBuffer,
            binding_types::{sampler, texture_2d, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderQueue, ViewQuery},
        sync_world::RenderEntity,
        texture::GpuImage,
        view::{ExtractedView, ViewTarget},
    },
};

pub(super) fn build(app: &mut App) {
    // Programs that only measure may do without assets.
    if app.world().contains_resource::<EmbeddedAssetRegistry>() {
        embedded_asset!(app, "background_pass.wgsl");
    }
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        warn!("CameraPlugin: no renderer, camera pictures will not be drawn");
        return;
    };
    render_app
        .init_resource::<SpecializedRenderPipelines<BackgroundPipeline>>()
        .add_systems(RenderStartup, init_background_pipeline)
        .add_systems(ExtractSchedule, extract_backgrounds)
        .add_systems(Render, prepare_backgrounds.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(Core3d, background_pass.before(main_opaque_pass_3d).in_set(Core3dSystems::MainPass));
}

/// What a view needs to draw its camera's picture.
#[derive(Component)]
struct ExtractedBackground {
    image: AssetId<Image>,
    frame_uv_from_view_uv: Vec4,
}

#[derive(ShaderType, Clone, Copy, PartialEq)]
struct BackgroundUniform {
    frame_uv_from_view_uv: Vec4,
}

/// Pipeline and bind group of one view; remade only when what they were made from changes.
#[derive(Component)]
struct PreparedBackground {
    pipeline: CachedRenderPipelineId,
    bind_group: BindGroup,
    made_from: (TextureViewId, BackgroundUniform),
}

#[derive(Resource)]
struct BackgroundPipeline {
    layout: BindGroupLayoutDescriptor,
    vertex: bevy::render::render_resource::VertexState,
    shader: Handle<Shader>,
}

fn init_background_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_camera_background_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                uniform_buffer::<BackgroundUniform>(false),
            ),
        ),
    );
    commands.insert_resource(BackgroundPipeline {
        layout,
        vertex: fullscreen_shader.to_vertex_state(),
        shader: load_embedded_asset!(asset_server.as_ref(), "background_pass.wgsl"),
    });
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct BackgroundPipelineKey {
    target_format: TextureFormat,
    samples: u32,
}

impl SpecializedRenderPipeline for BackgroundPipeline {
    type Key = BackgroundPipelineKey;

    fn specialize(&self, key: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("mirrorball_camera_background".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex.clone(),
            multisample: MultisampleState { count: key.samples, ..default() },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                targets: vec![Some(ColorTargetState {
                    format: key.target_format,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
                ..default()
            }),
            ..default()
        }
    }
}

type BackgroundSource = (RenderEntity, &'static ArCamera, &'static Camera, &'static CameraFrame, &'static FrameTexture);

fn extract_backgrounds(mut commands: Commands, cameras: Extract<Query<BackgroundSource>>) {
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

fn prepare_backgrounds(
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

fn background_pass(
    view: ViewQuery<(&ExtractedCamera, &ViewTarget, &PreparedBackground)>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (camera, target, prepared) = view.into_inner();
    let Some(pipeline) = pipeline_cache.get_render_pipeline(prepared.pipeline) else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_camera_background_pass"),
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_camera_background");
    if let Some(viewport) = &camera.viewport {
        pass.set_camera_viewport(viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &prepared.bind_group, &[]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
