//! Rendering until something has happened.

use super::{HeadlessError, update};
use crate::device::{self, DeviceState, PATIENCE};
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

/// Frames without anything to compile after which all pipelines are there.
const MIN_QUIET_FRAMES: u32 = 4;

/// Renders frame after frame until `done` says so, which is asked after each.
///
/// # Errors
/// [`HeadlessError::TooLate`] with `what`, if that takes longer than `patience`; as [`update`].
pub fn update_until(
    app: &mut App,
    what: &'static str,
    patience: Duration,
    mut done: impl FnMut(&mut App) -> bool,
) -> Result<(), HeadlessError> {
    let started = Instant::now();
    loop {
        update(app)?;
        // Frames are drawn faster than a slow device finishes them: what waits would be taken for a device that hangs.
        match app.world().get_resource::<RenderDevice>().map(|device| device::wait(device, PATIENCE)) {
            Some(DeviceState::Busy) => return Err(HeadlessError::Hung(PATIENCE)),
            Some(DeviceState::Lost) => return Err(HeadlessError::Stopped),
            Some(DeviceState::Idle) | None => (),
        }
        if done(app) {
            return Ok(());
        }
        if started.elapsed() > patience {
            return Err(HeadlessError::TooLate(what, patience));
        }
        // What is waited for needs the processor more than the next frame does.
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Renders frames until all shaders that these ask for have loaded and are compiled.
///
/// # Errors
/// As [`update_until`].
pub fn settle(app: &mut App) -> Result<(), HeadlessError> {
    let mut quiet = 0;
    update_until(app, "loading all shaders", PATIENCE, |app| {
        let pipelines = app.get_sub_app(RenderApp).and_then(|app| app.world().get_resource::<PipelineCache>());
        let is_waiting = pipelines.is_some_and(has_loading_pipelines);
        quiet = if is_waiting { 0 } else { quiet + 1 };
        quiet >= MIN_QUIET_FRAMES
    })
}

/// Whether a pipeline waits for a shader that loads. Shaders with a fixed name are there from the start or never: Bevy asks for
/// some that small devices do not have.
fn has_loading_pipelines(cache: &PipelineCache) -> bool {
    let waiting: HashSet<usize> = cache.waiting_pipelines().collect();
    let loads = |pipeline: &CachedPipeline| match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(of) => !matches!(of.vertex.shader.id(), AssetId::Uuid { .. }),
        PipelineDescriptor::ComputePipelineDescriptor(of) => !matches!(of.shader.id(), AssetId::Uuid { .. }),
    };
    cache.pipelines().enumerate().any(|(id, pipeline)| waiting.contains(&id) && loads(pipeline))
}
