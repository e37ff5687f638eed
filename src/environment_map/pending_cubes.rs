//! Cubes that are still being rendered.

use bevy::prelude::*;

/// Whether cubes are still being rendered without which a picture is not complete.
/// [`headless::settle`](crate::headless::settle) waits for them.
#[derive(Resource, Default)]
pub(crate) struct PendingCubes(pub(crate) bool);
