//! Albedo of virtual surfaces.

use bevy::prelude::*;

/// Fraction of light per channel that a virtual surface reflects, in the mean over its texture, linear. The materials
/// insert it.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfaceAlbedo(pub(crate) Vec3);

impl Default for SurfaceAlbedo {
    /// Of a mesh with a material that the crate does not know: a middle gray.
    fn default() -> Self {
        Self(Vec3::splat(0.5))
    }
}
