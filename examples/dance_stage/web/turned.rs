//! Phones that are turned while they film: browsers deliver upright frames then, of another shape.

use super::report;
use bevy::prelude::*;
use bevy_mirrorball::{camera::CameraFrame, prelude::*};

/// Turns the intrinsics with the frames, and tells the page the shape of the picture.
pub(super) fn turn_with_phone(mut cameras: Query<(&mut ArCamera, &CameraFrame), Changed<CameraFrame>>) {
    for (mut camera, frame) in &mut cameras {
        let is_upright = |size: UVec2| size.y > size.x;
        if let Some(known) = camera.intrinsics
            && is_upright(known.size) != is_upright(frame.pixels.size)
        {
            camera.intrinsics = Some(known.turned());
            report::tell("shape", if is_upright(frame.pixels.size) { "upright" } else { "across" });
        }
    }
}
