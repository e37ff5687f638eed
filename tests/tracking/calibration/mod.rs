//! Calibration of cameras, and frames that are undistorted with its result.

#[cfg(feature = "apriltag")]
mod photographs;
#[cfg(feature = "apriltag")]
mod render;
#[cfg(feature = "apriltag")]
mod rendered;
mod synthetic;
mod undistorted;

use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::prelude::*;

/// A place of a board in camera space: x right, y down, z forward; the board's x right, y down, z into the paper.
#[derive(Clone, Copy)]
pub(crate) struct BoardPose {
    pub rotation: Quat,
    pub translation: Vec3,
}

impl BoardPose {
    /// The middle of a board of a size in meters is at `middle`, slanted about the camera's axes x and y and turned
    /// about the line of sight, in degrees.
    pub(crate) fn new(board: Vec2, middle: Vec3, slant: Vec2, turn: f32) -> Self {
        let rotation = Quat::from_euler(EulerRot::XYZ, slant.x.to_radians(), slant.y.to_radians(), turn.to_radians());
        Self { rotation, translation: middle - rotation * (0.5 * board).extend(0.0) }
    }

    /// Pixel at which a lens shows a point of the board.
    pub(crate) fn seen(&self, lens: &Intrinsics, board: DVec2) -> DVec2 {
        let at = self.rotation * board.as_vec2().extend(0.0) + self.translation;
        let pinhole = lens.center + lens.focal * at.truncate() / at.z;
        lens.distort_pixel(pinhole).as_dvec2()
    }
}

/// Ten views of a board of this size that bring it into all corners of the frame of a common webcam.
pub(crate) fn ten_views(board: Vec2) -> [BoardPose; 10] {
    [
        (0.0, 0.0, 0.30, 0.0, 0.0, 0.0),
        (-0.10, 0.06, 0.30, 30.0, 5.0, 90.0),
        (0.10, 0.06, 0.31, -30.0, 5.0, 80.0),
        (0.10, -0.06, 0.29, 5.0, 35.0, 95.0),
        (-0.10, -0.06, 0.30, -5.0, -35.0, 88.0),
        (0.12, 0.06, 0.32, 25.0, -25.0, 10.0),
        (-0.12, -0.06, 0.30, -25.0, 25.0, -10.0),
        (0.0, 0.04, 0.27, -35.0, 0.0, 90.0),
        (-0.10, 0.07, 0.34, 20.0, 30.0, 45.0),
        (0.10, -0.07, 0.33, -15.0, -30.0, -45.0),
    ]
    .map(|(x, y, z, slant_x, slant_y, turn)| {
        BoardPose::new(board, Vec3::new(x, y, z), Vec2::new(slant_x, slant_y), turn)
    })
}

/// Places on a grid over the frame, up to its border.
pub(crate) fn grid(size: UVec2) -> impl Iterator<Item = Vec2> {
    let places = (0..=12).flat_map(|y| (0..=16).map(move |x| Vec2::new(x as f32, y as f32)));
    places.map(move |place| place / Vec2::new(16.0, 12.0) * size.as_vec2())
}

/// Largest distance in pixels between where two lenses show what their pinhole cameras have at the same pixel; for the
/// pixels at which the first one shows it.
pub(crate) fn largest_difference(truth: &Intrinsics, found: &Intrinsics, seen: impl Iterator<Item = Vec2>) -> f32 {
    let undistorted = |seen| truth.undistort_pixel(seen).expect("the lens shows its whole frame");
    seen.map(|seen| found.distort_pixel(undistorted(seen)).distance(seen)).fold(0.0, f32::max)
}
