//! The render world's half of the dome.
//!
//! **Enters:** the fitted dome, the source of its light and the camera with a visibility pass ([`extract`]).
//! **Leaves:** the contents of [`DomeTextures`](super::DomeTextures).
//!
//! # Order within a frame
//! 1. [`prepare_depth`] collects the casters and refits the views to redraw, then [`prepare_views`] writes all views.
//! 2. Before all cameras, in any order: [`weights_pass`] sums the environment cube over the cell of each direction if
//!    the cube has changed, and [`depth_pass`] draws the casters into the refreshed tiles of the atlas, of which
//!    [`depth_pyramid_pass`] reduces those of key lights.
//! 3. [`surfel_pass`] lights the surfels, unless nothing has changed.
//! 4. [`visibility_pass`] sums visibility × light per sample, between a camera's prepass and its main pass. What it has
//!    looked up before, it reads from the [`visibility_cache`].
//!
//! The other shaders are libraries: `caster.wgsl` poses vertices, `dome.wgsl` and `depth_pyramid.wgsl` are the layout
//! of the buffers and `bindings.wgsl` binds them, `maps.wgsl` and `soft_shadow.wgsl` read shadow maps,
//! `visibility.wgsl` sums over directions, `visibility_surfaces.wgsl` and `visibility_cache.wgsl` are what both shaders
//! of the visibility pass share, `samples.wgsl` has the samples of the prepass and of the visibility pass, and
//! materials import `receive.wgsl`.

pub(super) mod caster_buffers;
pub(super) mod caster_draw;
mod depth_pass;
pub(super) mod depth_pipeline;
mod depth_pyramid_pass;
mod depth_pyramid_pipeline;
mod extract;
pub(super) mod gpu;
mod prepare_depth;
mod prepare_depth_pyramids;
mod prepare_surfels;
mod prepare_views;
mod prepare_visibility;
mod prepare_weights;
mod surfel_pass;
mod surfel_pipeline;
mod visibility_cache;
mod visibility_pass;
mod visibility_pipeline;
mod weights_pass;
mod weights_pipeline;

pub(super) use prepare_depth_pyramids::PYRAMID_BLOCKS;

use crate::{MirrorballPasses, device, environment_map::CubeWrites};
use bevy::{
    asset::embedded_asset,
    core_pipeline::{Core3d, Core3dSystems, schedule::camera_driver},
    prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        render_resource::SpecializedMeshPipelines,
        renderer::{RenderGraph, RenderGraphSystems},
    },
    shader::{ShaderSettings, load_shader_library},
};

/// Loads the shader libraries that need no knowledge of the device.
pub(super) fn load_shaders(app: &mut App) {
    crate::luminance::load(app);
    load_shader_library!(app, "dome.wgsl");
    load_shader_library!(app, "depth_pyramid.wgsl");
    load_shader_library!(app, "bindings.wgsl");
    load_shader_library!(app, "caster.wgsl");
    load_shader_library!(app, "soft_shadow.wgsl");
    load_shader_library!(app, "maps.wgsl");
    load_shader_library!(app, "surfels.wgsl");
    load_shader_library!(app, "tile_surfels.wgsl");
    load_shader_library!(app, "visibility.wgsl");
    load_shader_library!(app, "receive.wgsl");
    load_shader_library!(app, "visibility_surfaces.wgsl");
    load_shader_library!(app, "visibility_cache.wgsl");
}

/// Loads the shader library that depends on where the driver places the samples of a pixel.
pub(super) fn load_sample_shaders(app: &mut App) {
    let is_mirrored = device::mirrors_samples(app);
    load_shader_library!(app, "samples.wgsl", move |settings: &mut ShaderSettings| {
        if is_mirrored {
            settings.shader_defs.push("MIRRORED_SAMPLES".into());
        }
    });
}

/// Adds the passes and what prepares them to the render world.
pub(super) fn build(app: &mut App) {
    crate::environment_map::load_shaders(app);
    embedded_asset!(app, "depth_pass.wgsl");
    embedded_asset!(app, "depth_pyramid_pass.wgsl");
    embedded_asset!(app, "weights_pass.wgsl");
    embedded_asset!(app, "surfel_pass.wgsl");
    embedded_asset!(app, "visibility_plan_pass.wgsl");
    embedded_asset!(app, "visibility_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<CubeWrites>()
        .init_resource::<SpecializedMeshPipelines<depth_pipeline::DepthPipeline>>()
        .init_resource::<extract::ExtractedDome>()
        .init_resource::<prepare_views::DomeViews>()
        .init_resource::<prepare_depth::PreparedDepth>()
        .init_resource::<prepare_depth_pyramids::PreparedDepthPyramids>()
        .init_resource::<prepare_weights::PreparedWeights>()
        .init_resource::<prepare_visibility::PreparedVisibility>()
        .init_resource::<prepare_surfels::PreparedSurfels>()
        .add_systems(
            RenderStartup,
            (
                depth_pipeline::init_depth_pipeline,
                depth_pyramid_pipeline::init_depth_pyramid_pipeline,
                weights_pipeline::init_weights_pipelines,
                surfel_pipeline::init_surfel_pipelines,
                visibility_pipeline::init_visibility_pipelines,
            ),
        )
        .add_systems(ExtractSchedule, extract::extract_dome)
        .add_systems(
            Render,
            (
                prepare_views::follow_dome.in_set(RenderSystems::PrepareResources),
                (
                    (
                        prepare_depth::prepare_depth,
                        (prepare_views::write_views, prepare_depth_pyramids::prepare_depth_pyramids),
                    )
                        .chain(),
                    prepare_weights::prepare_weights,
                    (prepare_visibility::prepare_visibility, prepare_surfels::prepare_surfels).chain(),
                )
                    .in_set(RenderSystems::PrepareBindGroups),
            ),
        )
        .add_systems(
            RenderGraph,
            (
                (depth_pass::depth_pass, depth_pyramid_pass::depth_pyramid_pass, surfel_pass::surfel_pass)
                    .chain()
                    .after(MirrorballPasses::ReadCubes)
                    .in_set(RenderGraphSystems::Render)
                    .before(camera_driver),
                weights_pass::weights_pass.in_set(MirrorballPasses::ReadCubes),
            ),
        )
        .add_systems(
            Core3d,
            visibility_pass::visibility_pass.after(Core3dSystems::Prepass).before(Core3dSystems::MainPass),
        );
}
