//! Render pass that draws the camera frame behind everything, before the first pass that draws surfaces and without
//! touching depth.

use super::{
    background_pipeline::{BackgroundPipeline, init_background_pipeline},
    prepare_backgrounds::{PreparedBackground, extract_backgrounds, prepare_backgrounds},
};
use bevy::{
    asset::{embedded_asset, io::embedded::EmbeddedAssetRegistry},
    camera::{MainPassResolutionOverride, Viewport},
    core_pipeline::{Core3d, Core3dSystems, core_3d::main_opaque_pass_3d},
    pbr::deferred::deferred_lighting,
    prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        render_resource::{PipelineCache, RenderPassDescriptor, SpecializedRenderPipelines},
        renderer::{RenderContext, ViewQuery},
        view::ViewTarget,
    },
};

/// Makes alpha tell real from virtual in the picture of an [`ArCamera`](super::ArCamera): it is 0 where the frame is
/// shown, the fraction of the pixel that is virtual elsewhere. Whoever adds it has to set alpha to 1 in the end.
#[derive(Component)]
pub(crate) struct MarksReal;

pub(super) fn build(app: &mut App) {
    // Programs that only measure have no assets.
    if app.world().contains_resource::<EmbeddedAssetRegistry>() {
        embedded_asset!(app, "background_pass.wgsl");
    }
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        warn!("CameraPlugin: no renderer, camera frames will not be drawn");
        return;
    };
    render_app
        .init_resource::<SpecializedRenderPipelines<BackgroundPipeline>>()
        .add_systems(RenderStartup, init_background_pipeline)
        .add_systems(ExtractSchedule, extract_backgrounds)
        .add_systems(Render, prepare_backgrounds.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            Core3d,
            background_pass.before(deferred_lighting).before(main_opaque_pass_3d).in_set(Core3dSystems::MainPass),
        );
}

fn background_pass(
    view: ViewQuery<(&ExtractedCamera, &ViewTarget, &PreparedBackground, Option<&MainPassResolutionOverride>)>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (camera, target, prepared, resolution) = view.into_inner();
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
    if let Some(viewport) = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution) {
        pass.set_camera_viewport(&viewport);
    }
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &prepared.bind_group, &[]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}
