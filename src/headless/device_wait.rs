//! Waiting for the graphics device, with a time limit.

use bevy::{
    prelude::*,
    render::{
        render_resource::PollType,
        renderer::{RenderDevice, RenderQueue},
    },
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

/// Time that the device may be busy without progress before it counts as hung.
pub(super) const MAX_BUSY_TIME: Duration = Duration::from_secs(120);

/// Activity of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DeviceState {
    /// All submitted work is done.
    Idle,
    /// Work was left at the end of the waiting time.
    Busy,
    /// The device is lost.
    Lost,
}

/// Waits until a device is idle, at most for `timeout`.
pub(super) fn wait(device: &RenderDevice, timeout: Duration) -> DeviceState {
    let poll = || device.poll(PollType::Wait { submission_index: None, timeout: Some(timeout) });
    // wgpu panics while it waits for a lost device.
    match catch_unwind(AssertUnwindSafe(poll)) {
        Ok(Ok(_)) => DeviceState::Idle,
        Ok(Err(_)) => DeviceState::Busy,
        Err(_) => DeviceState::Lost,
    }
}

/// Guard that waits for the device before the world that holds it is dropped. wgpu itself waits for six seconds, then
/// panics.
#[derive(Resource)]
pub(super) struct WaitBeforeDrop {
    device: RenderDevice,
    queue: RenderQueue,
}

impl WaitBeforeDrop {
    /// Adds the guard to an app whose renderer has started.
    pub(super) fn add(app: &mut App) {
        let world = app.world_mut();
        if let (Some(device), Some(queue)) =
            (world.get_resource::<RenderDevice>().cloned(), world.get_resource::<RenderQueue>().cloned())
        {
            world.insert_resource(Self { device, queue });
        }
    }
}

impl Drop for WaitBeforeDrop {
    fn drop(&mut self) {
        if wait(&self.device, MAX_BUSY_TIME) == DeviceState::Busy {
            error!(
                "the graphics device has been busy for {MAX_BUSY_TIME:?}, its driver seems to hang; its memory is not \
                 freed"
            );
            std::mem::forget(self.queue.clone());
        }
    }
}
