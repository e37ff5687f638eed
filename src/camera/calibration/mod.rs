//! Calibration of a camera: focal lengths, principal point and distortion of its lens from views of a printed board.
//!
//! **Enters:** frames in which a [`CalibrationBoard`] is seen at different slants, or points of any flat board with the
//! pixels at which they were seen ([`CalibrationView`]). **Leaves:** a [`Calibration`] with the
//! [`Intrinsics`](super::Intrinsics), the re-projection error, how well the views cover the frame, and
//! [advice](Calibration::advice). Its file is read by [`Intrinsics::open`](super::Intrinsics::open), which reads
//! calibrations of OpenCV and ROS too. `examples/calibrate` does all of this.
//!
//! # How to take views
//! Ten to twenty, sharp, the board flat on something stiff. Slants of 20° to 45° to each side tell the focal length;
//! frontal views do not. The distortion is known where the board was seen, so it has to come near all borders and into
//! the corners. Focus and zoom have to stay as they are in use, and the frames of the same shape.
//!
//! # Method
//! Each view has a homography (Hartley 1997), homographies have a common focal length (Zhang 2000), and
//! Levenberg–Marquardt adjusts everything together: two focal lengths, the principal point, five coefficients and six
//! numbers for each view. Errors above a pixel or so count linearly. Views that do not fit the others are left out.
//!
//! Markers are detected twice, see [`CalibrationBoard::calibrate`].
//!
//! # Cost
//! Ten views of 48 markers take about a second, most of it marker detection.

mod adjust;
mod board;
#[cfg(feature = "apriltag")]
mod board_sheet;
mod coverage;
mod error;
mod homography;
mod lens_file;
mod opencv_yaml;
mod solve;
mod start;

pub use board::CalibrationBoard;
pub use error::CalibrationError;
pub use solve::{Calibration, calibrate};

pub(super) use lens_file::IntrinsicsFields;

use bevy::math::DVec2;

/// Smallest number of views.
pub const MIN_VIEWS: usize = 3;
/// Smallest number of points of a view that is used.
pub const MIN_POINTS: usize = 8;

/// A point of a flat board and where it was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationPoint {
    /// Position on the board in meters, x to the right and y down.
    pub board: DVec2,
    /// Position in the frame in pixels, as the lens shows it (distorted). Pixel centers are at halves.
    pub frame: DVec2,
}

/// What was seen of a board in one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CalibrationView {
    /// The points, [`MIN_POINTS`] or more.
    pub points: Vec<CalibrationPoint>,
}
