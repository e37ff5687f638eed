//! Rendering until a condition is met.

use super::{
    HeadlessError,
    device_wait::{DeviceState, MAX_BUSY_TIME, wait},
    update,
};
use crate::environment_map::PendingCubes;
use bevy::{
    platform::{collections::HashSet, time::Instant},
    prelude::*,
    render::{
        RenderApp,
        render_resource::{CachedPipeline, CachedPipelineState, PipelineCache, PipelineDescriptor},
        renderer::RenderDevice,
    },
    shader::ShaderCacheError,
};
use std::time::Duration;

/// Number of successive frames without loading shaders after which all pipelines count as compiled.
const MIN_QUIET_FRAMES: u32 = 4;
/// Time to wait for shaders. Software Vulkan compiles those of all materials in a minute when it has the machine for
/// itself.
const MAX_LOADING_TIME: Duration = Duration::from_secs(300);
/// Largest number of frames to wait for cubes that are still being rendered: in scenes that always change, they always
/// are.
const MAX_CUBE_FRAMES: u32 = 128;

/// Renders frames until `done` returns true; it is called after each frame.
///
/// # Errors
/// [`HeadlessError::TooLate`] with `what`, if that takes longer than `patience`; [`HeadlessError::Hung`] if the GPU
/// takes two minutes over a frame; as [`update`].
pub fn update_until(
    app: &mut App,
    what: &'static str,
    patience: Duration,
    mut done: impl FnMut(&mut App) -> bool,
) -> Result<(), HeadlessError> {
    let started = Instant::now();
    loop {
        update(app)?;
        // Frames are submitted faster than a slow device finishes them. Without waiting here, the backlog would look
        // like a device that hangs.
        match app.world().get_resource::<RenderDevice>().map(|device| wait(device, MAX_BUSY_TIME)) {
            Some(DeviceState::Busy) => return Err(HeadlessError::Hung(MAX_BUSY_TIME)),
            Some(DeviceState::Lost) => return Err(HeadlessError::Stopped),
            Some(DeviceState::Idle) | None => (),
        }
        if done(app) {
            return Ok(());
        }
        if started.elapsed() > patience {
            return Err(HeadlessError::TooLate(what, patience));
        }
        // Leave the processor to the work that the condition waits for.
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Renders frames until all shaders that they use are loaded and compiled, and until mirrors show their neighbors
/// ([`NeighborReflections`](crate::materials::NeighborReflections)), for which it waits at most 128 frames more.
///
/// # Errors
/// [`HeadlessError::Pipeline`] if a pipeline cannot be compiled, or its shader is not there after five minutes; as
/// [`update_until`].
pub fn settle(app: &mut App) -> Result<(), HeadlessError> {
    let (mut quiet, mut cube_frames) = (0, 0);
    let settled = update_until(app, "loading all shaders", MAX_LOADING_TIME, |app| {
        let pipelines = cache(app);
        if pipelines.is_some_and(|cache| failed_pipeline(cache).is_some()) {
            return true;
        }
        let is_loading = pipelines.is_some_and(has_loading_pipelines);
        let is_pending = app.world().get_resource::<PendingCubes>().is_some_and(|cubes| cubes.0);
        cube_frames += u32::from(is_pending && !is_loading);
        quiet = if is_loading || is_pending && cube_frames <= MAX_CUBE_FRAMES { 0 } else { quiet + 1 };
        quiet >= MIN_QUIET_FRAMES
    });
    let problem = match &settled {
        Ok(()) => cache(app).and_then(failed_pipeline),
        Err(HeadlessError::TooLate(..)) => cache(app).and_then(loading_pipeline),
        Err(_) => None,
    };
    problem.map_or(settled, |(pipeline, reason)| Err(HeadlessError::Pipeline { pipeline, reason }))
}

fn cache(app: &App) -> Option<&PipelineCache> {
    app.get_sub_app(RenderApp).and_then(|app| app.world().get_resource::<PipelineCache>())
}

/// Label of a pipeline that will never be compiled, and the reason.
fn failed_pipeline(cache: &PipelineCache) -> Option<(String, String)> {
    cache.pipelines().find_map(|pipeline| match &pipeline.state {
        CachedPipelineState::Err(
            error @ (ShaderCacheError::ProcessShaderError(_) | ShaderCacheError::CreateShaderModule(_)),
        ) => Some((label(pipeline), error.to_string())),
        _ => None,
    })
}

/// Label of a pipeline that waits for a shader, and what it waits for.
fn loading_pipeline(cache: &PipelineCache) -> Option<(String, String)> {
    let (_, pipeline) = loading_pipelines(cache).next()?;
    let reason = match &pipeline.state {
        CachedPipelineState::Err(error) => error.to_string(),
        _ => "it is still being compiled".to_owned(),
    };
    Some((label(pipeline), format!("{reason} Check that the shader and all that it imports exist")))
}

fn label(pipeline: &CachedPipeline) -> String {
    let label = match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(of) => &of.label,
        PipelineDescriptor::ComputePipelineDescriptor(of) => &of.label,
    };
    label.as_deref().unwrap_or("without a label").to_owned()
}

/// Returns whether a pipeline waits for a shader that is loading.
fn has_loading_pipelines(cache: &PipelineCache) -> bool {
    loading_pipelines(cache).next().is_some()
}

/// Pipelines that wait for shaders. Shaders with a fixed id are present from the start or never: Bevy requests some
/// that small devices do not have.
fn loading_pipelines(cache: &PipelineCache) -> impl Iterator<Item = (usize, &CachedPipeline)> {
    let waiting: HashSet<usize> = cache.waiting_pipelines().collect();
    let loads = |pipeline: &CachedPipeline| match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(of) => !matches!(of.vertex.shader.id(), AssetId::Uuid { .. }),
        PipelineDescriptor::ComputePipelineDescriptor(of) => !matches!(of.shader.id(), AssetId::Uuid { .. }),
    };
    cache.pipelines().enumerate().filter(move |(id, pipeline)| waiting.contains(id) && loads(pipeline))
}
