//! Rendering until a condition is met.

use super::{HeadlessError, update};
use crate::device::{self, DeviceState, MAX_BUSY_TIME};
use bevy::{
    platform::collections::HashSet,
    prelude::*,
    render::{
        RenderApp,
        render_resource::{CachedPipeline, PipelineCache, PipelineDescriptor},
        renderer::RenderDevice,
    },
};
use std::time::{Duration, Instant};

/// Number of successive frames without loading shaders after which all pipelines count as compiled.
const MIN_QUIET_FRAMES: u32 = 4;

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
        match app.world().get_resource::<RenderDevice>().map(|device| device::wait(device, MAX_BUSY_TIME)) {
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

/// Renders frames until all shaders that they use are loaded and compiled.
///
/// # Errors
/// As [`update_until`].
pub fn settle(app: &mut App) -> Result<(), HeadlessError> {
    let mut quiet = 0;
    update_until(app, "loading all shaders", MAX_BUSY_TIME, |app| {
        let pipelines = app.get_sub_app(RenderApp).and_then(|app| app.world().get_resource::<PipelineCache>());
        let is_waiting = pipelines.is_some_and(has_loading_pipelines);
        quiet = if is_waiting { 0 } else { quiet + 1 };
        quiet >= MIN_QUIET_FRAMES
    })
}

/// Returns whether a pipeline waits for a shader that is loading. Shaders with a fixed id are present from the start
/// or never: Bevy requests some that small devices do not have.
fn has_loading_pipelines(cache: &PipelineCache) -> bool {
    let waiting: HashSet<usize> = cache.waiting_pipelines().collect();
    let loads = |pipeline: &CachedPipeline| match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(of) => !matches!(of.vertex.shader.id(), AssetId::Uuid { .. }),
        PipelineDescriptor::ComputePipelineDescriptor(of) => !matches!(of.shader.id(), AssetId::Uuid { .. }),
    };
    cache.pipelines().enumerate().any(|(id, pipeline)| waiting.contains(&id) && loads(pipeline))
}
