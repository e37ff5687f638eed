//! The camera of synthetic frames.

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Pixels that are not quite square, and a center that is not quite in the middle.
pub(crate) const LENS: Intrinsics =
    Intrinsics { focal: Vec2::new(600.0, 604.0), center: Vec2::new(313.0, 246.0), size: UVec2::new(640, 480) };
