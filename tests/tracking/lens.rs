//! The camera of synthetic frames.

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Pixels that are not quite square, and a center that is not quite in the middle.
pub(crate) const LENS: Intrinsics =
    Intrinsics::new(Vec2::new(600.0, 604.0), Vec2::new(313.0, 246.0), UVec2::new(640, 480));
