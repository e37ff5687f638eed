//! Order of several cameras.

use bevy::prelude::*;

/// Key that sorts cameras, for whatever needs one of several: active cameras come first, then those of a lower
/// [`Camera::order`], then those spawned earlier.
pub(crate) fn camera_rank(entity: Entity, camera: &Camera) -> (bool, isize, Entity) {
    (!camera.is_active, camera.order, entity)
}
