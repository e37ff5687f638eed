//! Where the adjustment starts: focal length and poses from homographies.

use super::adjust::{Camera, Pose};
use crate::camera::{Distortion, distortion::BrownConrady};
use bevy::math::{DMat3, DVec2, DVec3, UVec2};

/// Focal length that is assumed if the views tell none, as a multiple of the width.
const USUAL_FOCAL: f64 = 0.9;
/// Range of focal lengths that are believed, as a multiple of the width: fields of view of 136° to 6°.
const FOCAL_RANGE: (f64, f64) = (0.2, 10.0);

/// A camera without distortion and with its principal point in the middle of the frame, and the pose of each view.
///
/// The sides of the board's squares are at right angles and of the same length, which makes two equations of each
/// homography (Zhang 2000, there for all intrinsics). Only the focal length is asked here, because distortion and noise
/// make the others worse than the guess.
pub(super) fn start(size: UVec2, frames_from_board: &[DMat3]) -> (Camera, Vec<Pose>) {
    let center = 0.5 * size.as_dvec2();
    let width = f64::from(size.x);
    // Least squares for 1 / f² of: inverse_square · across + along = 0.
    let (mut product, mut square) = (0.0, 0.0);
    for homography in frames_from_board {
        let centered = DMat3::from_translation(-center) * *homography;
        let scale = 1.0 / (centered.x_axis.truncate().length() * centered.y_axis.truncate().length()).sqrt();
        let (a, b) = (centered.x_axis * scale, centered.y_axis * scale);
        let (a2, b2) = (a.truncate(), b.truncate());
        for (across, along) in [
            (a2.dot(b2), a.z * b.z),
            (0.5 * (a2.length_squared() - b2.length_squared()), 0.5 * (a.z * a.z - b.z * b.z)),
        ] {
            product -= across * along;
            square += across * across;
        }
    }
    let focal = (square / product).sqrt();
    let (low, high) = (FOCAL_RANGE.0 * width, FOCAL_RANGE.1 * width);
    let focal = if (low..high).contains(&focal) { focal } else { USUAL_FOCAL * width };
    let camera = Camera { focal: DVec2::splat(focal), center, lens: BrownConrady::from(Distortion::NONE) };
    let poses = frames_from_board.iter().map(|homography| pose(focal, center, homography)).collect();
    (camera, poses)
}

/// Pose of a board from its homography.
fn pose(focal: f64, center: DVec2, frame_from_board: &DMat3) -> Pose {
    let camera_from_frame =
        DMat3::from_diagonal(DVec3::new(1.0 / focal, 1.0 / focal, 1.0)) * DMat3::from_translation(-center);
    let axes = camera_from_frame * *frame_from_board;
    let scale = (2.0 / (axes.x_axis.length() + axes.y_axis.length())).copysign(axes.z_axis.z);
    // Both axes turn by the same angle until they are at right angles.
    let (x, y) = ((axes.x_axis * scale).normalize(), (axes.y_axis * scale).normalize());
    let (sum, difference) = ((x + y).normalize(), (x - y).normalize());
    let (x, y) = ((sum + difference).normalize(), (sum - difference).normalize());
    Pose { rotation: DMat3::from_cols(x, y, x.cross(y)), translation: axes.z_axis * scale }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::{DQuat, EulerRot};

    #[test]
    fn focal_length_and_poses_of_perfect_homographies_are_exact() {
        let size = UVec2::new(640, 480);
        let intrinsics = DMat3::from_cols_array(&[500.0, 0.0, 0.0, 0.0, 500.0, 0.0, 320.0, 240.0, 1.0]);
        let views: Vec<(DQuat, DVec3)> = [(0.5, 0.1, 0.2), (-0.4, 0.3, 1.0), (0.1, -0.6, -2.0)]
            .map(|(x, y, z)| (DQuat::from_euler(EulerRot::XYZ, x, y, z), DVec3::new(0.1 * x, -0.1 * y, 0.5)))
            .into();
        let homography = |(rotation, translation): &(DQuat, DVec3)| {
            let axes = DMat3::from_quat(*rotation);
            intrinsics * DMat3::from_cols(axes.x_axis, axes.y_axis, *translation) * -0.3
        };
        let (camera, poses) = start(size, &views.iter().map(homography).collect::<Vec<_>>());
        assert!((camera.focal - 500.0).length() < 1e-6, "{}", camera.focal);
        for (pose, (rotation, translation)) in poses.iter().zip(&views) {
            assert!(pose.rotation.abs_diff_eq(DMat3::from_quat(*rotation), 1e-9), "{pose:?}");
            assert!((pose.translation - *translation).length() < 1e-9, "{pose:?}");
        }
    }

    #[test]
    fn frontal_views_tell_no_focal_length_and_get_the_usual_one() {
        let frontal = DMat3::from_cols_array(&[900.0, 0.0, 0.0, 0.0, 900.0, 0.0, 320.0, 240.0, 1.0]);
        let (camera, poses) = start(UVec2::new(640, 480), &[frontal; 3]);
        assert_eq!(camera.focal, DVec2::splat(576.0));
        assert!((poses[0].translation.z - 0.64).abs() < 1e-9);
    }
}
