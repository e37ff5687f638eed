//! Motion vectors of backgrounds for temporal antialiasing: it shows each frame alone, without those before.

use super::prepare_backgrounds::PreparedBackground;
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    camera::{MainPassResolutionOverride, Viewport},
    core_pipeline::{
        Core3d, Core3dSystems, FullscreenShader,
        core_3d::CORE_3D_DEPTH_FORMAT,
        prepass::{MOTION_VECTOR_PREPASS_FORMAT, ViewPrepassTextures},
    },
    prelude::*,
    render::{
        RenderApp, RenderStartup,
        camera::{ExtractedCamera, TemporalJitter},
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
            ColorTargetState, ColorWrites, CompareFunction, DepthStencilState, FragmentState, PipelineCache,
            RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages, StoreOp, binding_types::uniform_buffer,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::{Msaa, ViewDepthTexture, ViewUniform, ViewUniformOffset, ViewUniforms},
    },
    shader::{Shader, load_shader_library},
};

/// Loads the shader library that phantoms use too, with or without this stage.
pub(crate) fn load_real_motion(app: &mut App) {
    load_shader_library!(app, "real_motion.wgsl");
}

pub(super) fn build(app: &mut App) {
    // Programs that only measure have no assets, or none that are shaders.
    if app.world().contains_resource::<Assets<Shader>>() {
        load_real_motion(app);
        embedded_asset!(app, "background_motion_pass.wgsl");
    }
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .add_systems(RenderStartup, init_background_motion_pipeline)
        .add_systems(Core3d, background_motion_pass.after(Core3dSystems::Prepass).before(Core3dSystems::MainPass));
}

#[derive(Resource)]
struct BackgroundMotionPipeline {
    layout: BindGroupLayoutDescriptor,
    pipeline: CachedRenderPipelineId,
}

fn init_background_motion_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_camera_background_motion_layout",
        &BindGroupLayoutEntries::single(ShaderStages::FRAGMENT, uniform_buffer::<ViewUniform>(true)),
    );
    let pipeline = pipeline_cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("mirrorball_camera_background_motion".into()),
        layout: vec![layout.clone()],
        vertex: fullscreen_shader.to_vertex_state(),
        depth_stencil: Some(DepthStencilState {
            format: CORE_3D_DEPTH_FORMAT,
            depth_write_enabled: Some(false),
            // Depth is reversed: nothing is drawn where it is 0.
            depth_compare: Some(CompareFunction::GreaterEqual),
            stencil: default(),
            bias: default(),
        }),
        fragment: Some(FragmentState {
            shader: load_embedded_asset!(asset_server.as_ref(), "background_motion_pass.wgsl"),
            targets: vec![Some(ColorTargetState {
                format: MOTION_VECTOR_PREPASS_FORMAT,
                blend: None,
                write_mask: ColorWrites::ALL,
            })],
            ..default()
        }),
        ..default()
    });
    commands.insert_resource(BackgroundMotionPipeline { layout, pipeline });
}

type MovingView = (
    &'static ExtractedCamera,
    &'static ViewPrepassTextures,
    &'static ViewDepthTexture,
    &'static ViewUniformOffset,
    &'static Msaa,
    Option<&'static MainPassResolutionOverride>,
);

fn background_motion_pass(
    view: ViewQuery<MovingView, (With<PreparedBackground>, With<TemporalJitter>)>,
    pipeline: Option<Res<BackgroundMotionPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    view_uniforms: Res<ViewUniforms>,
    device: Res<RenderDevice>,
    mut ctx: RenderContext,
) {
    let (camera, prepass, depth, view_offset, msaa, resolution) = view.into_inner();
    let (Some(layout), Some(uniform), Some(motion)) =
        (pipeline, view_uniforms.uniforms.binding(), &prepass.motion_vectors)
    else {
        return;
    };
    // Temporal antialiasing does without multisampling.
    let Some(pipeline) = pipeline_cache.get_render_pipeline(layout.pipeline).filter(|_| *msaa == Msaa::Off) else {
        return;
    };
    let bind_group = device.create_bind_group(
        "mirrorball_camera_background_motion_bind_group",
        &pipeline_cache.get_bind_group_layout(&layout.layout),
        &BindGroupEntries::single(uniform),
    );
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_camera_background_motion_pass"),
        color_attachments: &[Some(motion.get_attachment())],
        depth_stencil_attachment: Some(depth.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    if let Some(viewport) = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution) {
        pass.set_camera_viewport(&viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &bind_group, &[view_offset.offset]);
    pass.draw(0..3, 0..1);
}
