//! Sizes of pictures that a device can draw.

use bevy::prelude::*;
use bevy_mirrorball::headless;

/// Returns an error with both numbers if the app's device cannot draw a picture of a size in pixels.
pub(crate) fn fits_device(app: &App, size: UVec2) -> Result<(), String> {
    match headless::max_texture_edge(app) {
        Some(max_edge) if size.max_element() > max_edge => Err(format!(
            "a picture of {} × {} pixels is larger than the textures of this device, which end at {max_edge}; choose a smaller \
             --size",
            size.x, size.y
        )),
        _ => Ok(()),
    }
}
