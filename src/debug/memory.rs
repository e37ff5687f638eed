//! GPU memory of the crate.

use bevy::{platform::collections::HashMap, render::renderer::RenderDevice};

/// GPU memory of the textures or buffers with one label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DeviceMemory {
    /// Label of the form `mirrorball_<stage>_<thing>`.
    pub label: String,
    /// Size of all allocations with this label together.
    pub bytes: u64,
}

/// Returns the GPU memory of the crate's textures and buffers, the largest first, or `None` if the backend does not
/// report it (only Vulkan and DirectX 12 do).
///
/// The function visits all allocations of the program. Use it for panels and reports, not in every frame.
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
