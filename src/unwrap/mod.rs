//! Unwrapping: camera frames → environment cube.
//!
//! **Enters:** frames of balls and probe cameras, with what [`probe`] measured in them, the gains of clipped light from
//! [`lighting`](crate::lighting), and the fallback. **Leaves:** an
//! [`EnvironmentCube`](crate::environment_map::EnvironmentCube), rewritten on the GPU whenever something that it
//! depends on has changed.
//!
//! # Method
//! Each texel of the cube gets the mean of the pixels that show its direction (`ball.wgsl`, `lens.wgsl`,
//! `frame_sampling.wgsl`), with clipped pixels multiplied by their gain (`clip_gains.wgsl`) and the blur of the
//! lookups taken back (`deconvolution.wgsl`). The result is merged with the cube's history by confidence
//! (`history.wgsl`). The documentation of [`probe`] describes how the cube combines several frames, and what fills
//! the parts that are not visible in any of them.
//!
//! # Cost
//! Per source and frame one compute dispatch of 6 · 128² threads, and one copy of the cube into the history.

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
        .init_resource::<extract::ExtractedSources>()
        .init_resource::<prepare_unwraps::PreparedUnwraps>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, unwrap_pipeline::init_unwrap_pipelines)
        .add_systems(ExtractSchedule, extract::extract_sources)
        .add_systems(Render, prepare_unwraps::prepare_unwraps.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, unwrap_pass::unwrap_pass.in_set(MirrorballPasses::WriteCubes));
}
