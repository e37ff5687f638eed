//! Temporal history: the environment cube as it was after the last dispatch.

use crate::environment_map::EnvironmentCube;
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages, TextureView,
            TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};
use std::time::Duration;

/// Time in seconds after which the confidence in a direction that is no longer visible has fallen to 1/e.
const MEMORY_SECONDS: f32 = 4.0;
/// Exponent that a change of the visible surroundings adds to that decay, per fraction by which they have changed.
const CHANGE_DECAY: f32 = 6.0;

/// Copy of an environment cube.
pub(super) struct History {
    pub(super) texture: Texture,
    pub(super) view: TextureView,
    /// Time at which the newest frame in it was captured.
    pub(super) captured: Duration,
}

impl History {
    pub(super) const EXTENT: Extent3d =
        Extent3d { width: EnvironmentCube::SIZE, height: EnvironmentCube::SIZE, depth_or_array_layers: 6 };

    pub(super) fn new(device: &RenderDevice) -> Self {
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("mirrorball_probe_history"),
            size: Self::EXTENT,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor {
            label: Some("mirrorball_probe_history_view"),
            dimension: Some(TextureViewDimension::D2Array),
            ..default()
        });
        Self { texture, view, captured: Duration::ZERO }
    }

    /// Factor on the confidence in the history when a frame captured at a time is merged into it, 0…1.
    pub(super) fn keep(&self, captured: Duration, change: f32) -> f32 {
        let elapsed = captured.abs_diff(self.captured).as_secs_f32();
        (-elapsed / MEMORY_SECONDS - CHANGE_DECAY * change).exp()
    }
}
