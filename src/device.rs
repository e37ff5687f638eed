//! Graphics device: requirements of the stages, and noticing its loss.
//!
//! Each stage calls [`can_draw`] when the renderer starts. If the device lacks something, the stage logs one line and
//! stays off.
//!
//! # Budget
//! All stages keep within WebGPU's default limits and need no optional feature: per shader stage 16 sampled textures,
//! 16 samplers, 8 storage buffers, 12 uniform buffers and 4 storage textures, in 4 bind groups.
//! `tests/environment/device.rs` counts.

use bevy::{
    prelude::*,
    render::{
        render_resource::{DownlevelFlags, PollType, WgpuLimits},
        renderer::{RenderAdapter, RenderAdapterInfo, RenderDevice},
    },
};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Requirements of a stage beyond drawing and compute shaders.
pub(crate) struct Needs {
    /// Name of the plugin, as users know it.
    pub plugin: &'static str,
    /// Consequence of the stage being off, for the log.
    pub purpose: &'static str,
    /// Storage buffers in one shader stage.
    pub storage_buffers: u32,
    /// Storage textures in one shader stage.
    pub storage_textures: u32,
}

impl Needs {
    /// Requirement that a device does not meet, in words.
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

/// Whether there is a renderer whose device meets the requirements of a stage. Logs a warning if not. To be called in a
/// plugin's `finish`, when the device is known.
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

/// Whether the driver mirrors the sample positions of a pixel from left to right, compared with the standard
/// positions that it claims to use. `SwiftShader` does: the depths of a slanted plane, drawn with four samples, are
/// those at (0.625, 0.125), (0.125, 0.375), (0.875, 0.625) and (0.375, 0.875).
pub(crate) fn mirrors_samples(app: &App) -> bool {
    app.world().get_resource::<RenderAdapterInfo>().is_some_and(|adapter| adapter.name.contains("SwiftShader"))
}

/// Marks an app that notices when the device is lost.
#[derive(Resource)]
struct NoticesLoss;

/// Asks the device at the end of each update whether it is lost, so that Bevy hears of it before it draws: it then ends
/// the game with [`AppExit::error`]. Drawing with a lost device would panic instead.
pub(crate) fn notice_loss(app: &mut App) {
    if !app.world().contains_resource::<NoticesLoss>() {
        app.insert_resource(NoticesLoss).add_systems(Last, ask_device.run_if(resource_exists::<RenderDevice>));
    }
}

fn ask_device(device: Res<RenderDevice>, mut is_lost: Local<bool>) {
    let poll = || device.poll(PollType::Poll);
    if !*is_lost && catch_unwind(AssertUnwindSafe(poll)).is_err() {
        error!("the graphics device is lost: its driver was reset or updated, or it was unplugged. Start again");
        *is_lost = true;
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
