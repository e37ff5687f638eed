//! Motion vectors of backgrounds for temporal antialiasing: it shows each frame alone, without those before.

use super::prepare_backgrounds::PreparedBackground;
use bevy::{
    asset::{embedded_asset, io::embedded::EmbeddedAssetRegistry, load_embedded_asset},
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
            CachedRenderPipelineId, ColorTargetState, ColorWrites, CompareFunction, DepthStencilState, FragmentState,
            PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor, StoreOp,
        },
        renderer::{RenderContext, ViewQuery},
        view::{Msaa, ViewDepthTexture},
    },
};

/// Motion in UV that points out of the view, where temporal antialiasing has no history: it then shows the new frame
/// alone. With a history it would lower the contrast of frames at rest and drag those in motion. Twin of
/// `WITHOUT_HISTORY` in `background_motion_pass.wgsl`.
const WITHOUT_HISTORY: Vec2 = Vec2::splat(8.0);

/// Motion vector of camera frames in a view with or without temporal antialiasing. A frame has moved and blurred in the
/// real camera already, so motion blur must take it as it is.
pub(crate) fn motion_of_frame(is_antialiased: bool) -> Vec2 {
    if is_antialiased { WITHOUT_HISTORY } else { Vec2::ZERO }
}

pub(super) fn build(app: &mut App) {
    // Programs that only measure have no assets.
    if app.world().contains_resource::<EmbeddedAssetRegistry>() {
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
struct BackgroundMotionPipeline(CachedRenderPipelineId);

fn init_background_motion_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
    pipeline_cache: Res<PipelineCache>,
) {
    let pipeline = pipeline_cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("mirrorball_camera_background_motion".into()),
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
    commands.insert_resource(BackgroundMotionPipeline(pipeline));
}

type MovingView = (
    &'static ExtractedCamera,
    &'static ViewPrepassTextures,
    &'static ViewDepthTexture,
    &'static Msaa,
    Option<&'static MainPassResolutionOverride>,
);

fn background_motion_pass(
    view: ViewQuery<MovingView, (With<PreparedBackground>, With<TemporalJitter>)>,
    pipeline: Option<Res<BackgroundMotionPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (camera, prepass, depth, msaa, resolution) = view.into_inner();
    let (Some(pipeline), Some(motion)) = (pipeline, &prepass.motion_vectors) else {
        return;
    };
    // Temporal antialiasing does without multisampling.
    let Some(pipeline) = pipeline_cache.get_render_pipeline(pipeline.0).filter(|_| *msaa == Msaa::Off) else {
        return;
    };
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
    pass.draw(0..3, 0..1);
}
