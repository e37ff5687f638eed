//! Camera pictures in.

mod frame;
mod intrinsics;

pub use frame::{CameraFrame, FramePixels, srgb_to_linear};
pub use intrinsics::Intrinsics;

use bevy::prelude::*;

/// A game camera that stands where the real camera stands.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Debug, Clone)]
#[require(Camera3d)]
pub struct ArCamera {
    /// The real camera's intrinsics.
    pub intrinsics: Option<Intrinsics>,
}
