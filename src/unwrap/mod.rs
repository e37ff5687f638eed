//! Unwrapping: camera frames → environment cube.
//!
//! **Enters:** the frame that shows a ball or that a probe camera delivers, with the measurements of
//! [`probe`], the gains of clipped light from [`lighting`](crate::lighting), and the fallback.
//! **Leaves:** an [`EnvironmentCube`](crate::environment_map::EnvironmentCube), rewritten on the GPU whenever one of
//! its inputs has changed.
//!
//! # Method
//! Each texel of the cube gets the mean of the pixels that show its direction (`ball.wgsl`, `lens.wgsl`,
//! `frame_sampling.wgsl`), with clipped pixels multiplied by their gain (`clip_gains.wgsl`) and the blur of the
//! lookups taken back (`deconvolution.wgsl`). The result is merged with the cube's history by confidence
//! (`history.wgsl`).
//!
//! # Frames and units
//! The cube is in world axes and Bevy's left-handed cube convention (a lookup negates z). It holds radiance in linear
//! camera units: the frame divided by the ball's reflectance, times the gain of the clip recovery where the camera had
//! clipped.
//!
//! # Directions that no frame shows
//! The ball hides a cone behind itself (half angle asin(radius/distance), about 4° at 0.75 m), the outermost 1.5
//! pixels of its image mix with the background, phantoms stand in front of it, and the frame ends. Each texel has a
//! confidence: pixels per texel where its direction is visible. A third of the confidence is left after four seconds,
//! less if the visible part has changed. Each texel takes the best source of the following, blended without an edge:
//! 1. the present observation, unless the history saw the direction much finer not long ago and still agrees with it,
//! 2. towards the rim and behind it, where the ball is coarse: the camera's direct view of the phantoms that lie there
//!    (as boxes; by direction where there is no phantom, provided that there are any),
//! 3. behind the rim: an arc of the rim, which grows with the distance from the rim,
//! 4. elsewhere: the history, scaled as the visible part has become brighter or darker,
//! 5. the [`EnvironmentFallback`](crate::probe::EnvironmentFallback), until something has been measured.
//!
//! # Several sources, one cube
//! All balls and every [`LightProbeCamera`](crate::probe::LightProbeCamera) (fisheye, 360°, sphere map) write one
//! cube, one after the other. Where several see a direction, the finer frame wins. So a fisheye that looks up and a
//! ball that shows the rest form one environment.
//!
//! # Sharpness
//! A mirror that interpolates the cube linearly between its texels should show the pixels of the frame again, without
//! additional blur. Two bilinear filters (frame → cube → mirror) spread each pixel over its neighbors; a
//! deconvolution step compensates for that. Clipped pixels stay as they are, but the light that a lamp has leaked
//! into its neighbors is removed, because a clipped lamp counts as white already.
//!
//! # Cost
//! One compute dispatch of 6 · 128² threads per source and new frame, and a copy of the cube that keeps the
//! history. Each thread searches for a pixel three times, interpolates between four pixels as often as the texel
//! covers pixels (once for balls up to some 250 pixels across, at most 16 times), and between twelve once for the
//! deconvolution.
//!
//! # Limits
//! The camera's direct view shows the light of a point on the box around a phantom, which is right for matte objects.
//! All probes are merged by direction, as if they stood in one place.

mod extract;
mod fading;
mod history;
mod prepare_unwraps;
mod source_buffers;
mod source_view;
mod unwrap_pass;
mod unwrap_pipeline;
mod unwrap_uniform;

use crate::{
    MirrorballPasses,
    device::{self, Needs},
    environment_map::{self, CubeWrites},
    probe, trigonometry,
};
use bevy::{
    asset::embedded_asset,
    prelude::*,
    render::{ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems, renderer::RenderGraph},
    shader::load_shader_library,
};

/// Writes the environment cube. Needs [`ProbePlugin`](crate::probe::ProbePlugin).
pub struct UnwrapPlugin;

impl Plugin for UnwrapPlugin {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "UnwrapPlugin",
            purpose: "environments will not be measured",
            storage_buffers: 3,
            storage_textures: 1,
        };
        if device::can_draw(app, &needs) {
            build_pass(app);
        }
    }
}

fn build_pass(app: &mut App) {
    crate::luminance::load(app);
    trigonometry::load(app);
    environment_map::load_shaders(app);
    probe::load_shaders(app);
    load_shader_library!(app, "bindings.wgsl");
    load_shader_library!(app, "frame_sampling.wgsl");
    load_shader_library!(app, "deconvolution.wgsl");
    load_shader_library!(app, "clip_gains.wgsl");
    load_shader_library!(app, "observation.wgsl");
    load_shader_library!(app, "ball.wgsl");
    load_shader_library!(app, "lens.wgsl");
    load_shader_library!(app, "history.wgsl");
    embedded_asset!(app, "unwrap_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<extract::ExtractedCubes>()
        .init_resource::<prepare_unwraps::PreparedUnwraps>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, unwrap_pipeline::init_unwrap_pipelines)
        .add_systems(ExtractSchedule, extract::extract_sources)
        .add_systems(Render, prepare_unwraps::prepare_unwraps.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, unwrap_pass::unwrap_pass.in_set(MirrorballPasses::WriteCubes));
}
