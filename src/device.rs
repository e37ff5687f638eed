//! What stages need of the graphics device, and how long the crate waits for it.
//!
//! A stage asks [`can_draw`] when the renderer starts and stays off, with one line in the log, where something is missing.
//!
//! # Budget
//! Everything keeps within WebGPU's default limits, per shader stage 16 sampled textures, 16 samplers, 8 storage buffers, 12
//! uniform buffers and 4 storage textures, in 4 bind groups, and needs no optional feature. `tests/device.rs` counts.

use bevy::{
    prelude::*,
    render::{
        render_resource::{DownlevelFlags, PollType, WgpuLimits},
        renderer::{RenderAdapter, RenderAdapterInfo, RenderDevice, RenderQueue},
    },
};
use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    time::Duration,
};

/// How long the device may be busy without any news before it counts as hung.
pub(crate) const MAX_BUSY_TIME: Duration = Duration::from_secs(120);

/// What a stage needs beyond drawing and compute shaders.
pub(crate) struct Needs {
    /// The plugin, as users know it.
    pub plugin: &'static str,
    /// What is missing without the stage.
    pub purpose: &'static str,
    /// In one shader stage.
    pub storage_buffers: u32,
    pub storage_textures: u32,
}

impl Needs {
    /// What the device lacks, in words.
    fn missing(&self, limits: &WgpuLimits, flags: DownlevelFlags) -> Option<String> {
        let too_few = |needed: u32, found: u32, what: &str| {
            (needed > found).then(|| format!("{needed} {what} in a shader stage, and the device allows {found}"))
        };
        if !flags.contains(DownlevelFlags::COMPUTE_SHADERS) {
            return Some("compute shaders, and the device has none".to_owned());
        }
        too_few(self.storage_buffers, limits.max_storage_buffers_per_shader_stage, "storage buffers").or_else(|| {
            too_few(self.storage_textures, limits.max_storage_textures_per_shader_stage, "storage textures")
        })
    }
}

/// Whether there is a renderer whose device has what a stage needs. If not, says so in the log. In a plugin's `finish`, when the
/// device is known.
pub(crate) fn can_draw(app: &App, needs: &Needs) -> bool {
    let Needs { plugin, purpose, .. } = needs;
    let (Some(device), Some(adapter)) =
        (app.world().get_resource::<RenderDevice>(), app.world().get_resource::<RenderAdapter>())
    else {
        warn!("{plugin}: no renderer, {purpose}");
        return false;
    };
    match needs.missing(&device.limits(), adapter.get_downlevel_capabilities().flags) {
        Some(missing) => {
            warn!("{plugin}: needs {missing}; {purpose}");
            false
        }
        None => true,
    }
}

/// Whether the driver places the samples of a pixel mirrored from left to right, against the standard places that it claims to
/// use. `SwiftShader` does: depths of a slanted plane, drawn with four samples, are those of (0.625, 0.125), (0.125, 0.375),
/// (0.875, 0.625) and (0.375, 0.875).
pub(crate) fn mirrors_samples(app: &App) -> bool {
    app.world().get_resource::<RenderAdapterInfo>().is_some_and(|adapter| adapter.name.contains("SwiftShader"))
}

/// What a device does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DeviceState {
    /// It has done all it was given.
    Idle,
    /// It has not, within the time given to it.
    Busy,
    Lost,
}

/// Waits until a device is idle, at most for some time.
pub(crate) fn wait(device: &RenderDevice, timeout: Duration) -> DeviceState {
    let poll = || device.poll(PollType::Wait { submission_index: None, timeout: Some(timeout) });
    // wgpu panics while it waits for a lost device.
    match catch_unwind(AssertUnwindSafe(poll)) {
        Ok(Ok(_)) => DeviceState::Idle,
        Ok(Err(_)) => DeviceState::Busy,
        Err(_) => DeviceState::Lost,
    }
}

/// Lets the device finish before a world that holds it is dropped: wgpu waits for six seconds, and panics then.
#[derive(Resource)]
pub(crate) struct WaitBeforeDrop {
    device: RenderDevice,
    queue: RenderQueue,
}

impl WaitBeforeDrop {
    /// Adds it to an app whose renderer has started.
    pub(crate) fn add(app: &mut App) {
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
                "the graphics device has been busy for {MAX_BUSY_TIME:?}, its driver seems to hang; its memory is not freed"
            );
            std::mem::forget(self.queue.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_device_lacks_is_named() {
        let needs = Needs {
            plugin: "ShadowsPlugin",
            purpose: "nothing casts shadows",
            storage_buffers: 6,
            storage_textures: 1,
        };
        let missing = |limits, flags| needs.missing(&limits, flags);
        assert_eq!(missing(WgpuLimits::default(), DownlevelFlags::all()), None);
        assert!(missing(WgpuLimits::default(), DownlevelFlags::empty()).is_some_and(|text| text.contains("compute")));
        let few = WgpuLimits { max_storage_buffers_per_shader_stage: 4, ..default() };
        let text = missing(few, DownlevelFlags::all()).expect("too few");
        assert!(text.contains('6') && text.contains('4') && text.contains("storage buffers"), "{text}");
    }
}
