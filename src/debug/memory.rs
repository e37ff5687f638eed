//! Memory on the graphics device.

use bevy::{platform::collections::HashMap, render::renderer::RenderDevice};

/// What textures or buffers of one label take up on the graphics device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceMemory {
    /// `mirrorball_<stage>_<thing>`.
    pub label: String,
    /// All of that label together.
    pub bytes: u64,
}

/// What the crate's textures and buffers take up on the graphics device, the largest first; `None` where the backend does not tell
/// (only Vulkan and DirectX 12 do).
///
/// Walks through all allocations of the program: for panels and reports, not for every frame.
///
/// ```no_run
/// # use bevy::{prelude::*, render::renderer::RenderDevice};
/// # use bevy_mirrorball::debug::device_memory;
/// fn print_memory(device: Res<RenderDevice>) {
///     for part in device_memory(&device).unwrap_or_default() {
///         info!("{}: {} KiB", part.label, part.bytes / 1024);
///     }
/// }
/// ```
pub fn device_memory(device: &RenderDevice) -> Option<Vec<DeviceMemory>> {
    let mut sums = HashMap::<String, u64>::default();
    for allocation in device.wgpu_device().generate_allocator_report()?.allocations {
        if allocation.name.starts_with("mirrorball_") {
            *sums.entry(allocation.name).or_default() += allocation.size;
        }
    }
    let mut parts: Vec<_> = sums.into_iter().map(|(label, bytes)| DeviceMemory { label, bytes }).collect();
    parts.sort_by(|a, b| b.bytes.cmp(&a.bytes).then_with(|| a.label.cmp(&b.label)));
    Some(parts)
}
