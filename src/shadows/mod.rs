//! Dome of shadow directions.

use bevy::prelude::*;

/// A dome of shadow-casting directions colored by the measured environment; its up axis is the entity's +Y.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct ShadowDomeLight {
    /// Number of directions on the hemisphere, 1…256 (clamped). Each has its own shadow map. Defaults to 64.
    pub directions: u32,
    /// Side of one direction's square shadow map in texels, 32…1024 (clamped and rounded up to a power of two).
    /// Defaults to 256.
    pub resolution: u32,
}

impl Default for ShadowDomeLight {
    fn default() -> Self {
        Self { directions: 64, resolution: 256 }
    }
}
