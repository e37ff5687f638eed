//! Pose of a square from its four corners.
//!
//! From a distance, a square has two poses that look nearly alike: mirrored in tilt about the line of sight. The first
//! comes from the homography of the corners, the second from mirroring its axes along the line of sight; both are
//! refined by Levenberg–Marquardt on the reprojection error (compare Collins & Bartoli 2014, *Infinitesimal
//! plane-based pose estimation*). Everything is computed in double precision in the axes of computer vision (x right,
//! y down, z forward) and converted to Bevy's.

use super::pose_fit::{CvPose, Lens, PointPair, error, refine};
use crate::camera::Intrinsics;
use bevy::{
    math::{DMat3, DVec2, DVec3},
    prelude::*,
};

/// A pose of a marker with its reprojection error.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct MarkerPose {
    /// Marker frame (+X right, +Y out of the paper, +Z to the bottom edge) → camera frame (Bevy axes), in meters.
    pub camera_from_marker: Isometry3d,
    /// Root mean square distance between the corners and their reprojections, in pixels.
    pub reprojection_error: f32,
}

/// The two poses that best explain the corners of a square, the better one first.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct PoseCandidates {
    /// The pose with the smaller reprojection error.
    pub best: MarkerPose,
    /// The other pose; equal to `best` if both starting points lead to the same pose.
    pub alternative: MarkerPose,
}

/// Smallest ratio of the alternative's reprojection error to that of the best pose at which the best one is certain.
const MIN_UNAMBIGUOUS_ERROR_RATIO: f32 = 3.0;
/// Smallest angle in radians between the normals of two different candidates.
const MIN_NORMAL_DIFFERENCE: f64 = 1e-3;

impl PoseCandidates {
    /// Returns whether the corners alone do not decide between the two poses.
    pub fn is_ambiguous(&self) -> bool {
        self.best != self.alternative
            && self.alternative.reprojection_error
                < MIN_UNAMBIGUOUS_ERROR_RATIO * self.best.reprojection_error.max(1e-3)
    }

    /// Returns the more plausible pose: the best one, or if the corners do not decide, the one that is closer to the
    /// last pose.
    pub fn choose(&self, last: Option<&Isometry3d>) -> MarkerPose {
        match last {
            Some(last) if self.is_ambiguous() => {
                let turn = |pose: &MarkerPose| pose.camera_from_marker.rotation.angle_between(last.rotation);
                if turn(&self.alternative) < turn(&self.best) { self.alternative } else { self.best }
            }
            _ => self.best,
        }
    }

    /// Both poses of a square with sides of `size` meters; corners as in
    /// [`DetectedMarker::corners`](super::DetectedMarker::corners). Returns `None` if the corners are not a convex
    /// quadrilateral.
    pub fn from_corners(corners: &[DVec2; 4], intrinsics: &Intrinsics, size: f64) -> Option<Self> {
        let pairs = square_points(size).into_iter().zip(*corners).map(|(point, pixel)| PointPair::new(point, pixel));
        let (pairs, lens): (Vec<_>, _) = (pairs.collect(), Lens::from(intrinsics));
        let first = refine(&pairs, &lens, first_guess(corners, &lens, size)?)?;
        let second = refine(&pairs, &lens, first.mirrored()).unwrap_or(first);
        let to_marker_pose = |pose: &CvPose| MarkerPose {
            camera_from_marker: pose.to_isometry(),
            reprojection_error: error(&pairs, &lens, pose) as f32,
        };
        Some(Self::sorted(to_marker_pose(&first), to_marker_pose(&second)))
    }

    /// Two poses, the better one first; one if they are the same.
    pub(super) fn sorted(first: MarkerPose, second: MarkerPose) -> Self {
        let normal = |pose: &MarkerPose| pose.camera_from_marker.rotation.as_dquat() * DVec3::Y;
        if normal(&first).angle_between(normal(&second)) < MIN_NORMAL_DIFFERENCE {
            return Self { best: first, alternative: first };
        }
        let is_first_better = first.reprojection_error <= second.reprojection_error;
        let (best, alternative) = if is_first_better { (first, second) } else { (second, first) };
        Self { best, alternative }
    }
}

/// Corners of a square with sides of `size` meters in its own frame; in the order of
/// [`DetectedMarker::corners`](super::DetectedMarker::corners).
pub(super) fn square_points(size: f64) -> [DVec3; 4] {
    let h = 0.5 * size;
    [DVec3::new(-h, 0.0, -h), DVec3::new(h, 0.0, -h), DVec3::new(h, 0.0, h), DVec3::new(-h, 0.0, h)]
}

/// The homography that maps the unit square (top-left, top-right, bottom-right, bottom-left) to four corners, in closed
/// form (Heckbert 1989).
pub(super) fn unit_square_to(corners: &[DVec2; 4]) -> Option<DMat3> {
    let [p0, p1, p2, p3] = *corners;
    let (d1, d2, s) = (p1 - p2, p3 - p2, p0 - p1 + p2 - p3);
    let determinant = d1.perp_dot(d2);
    let (g, h) = (s.perp_dot(d2) / determinant, d1.perp_dot(s) / determinant);
    let matrix = DMat3::from_cols((p1 - p0 + g * p1).extend(g), (p3 - p0 + h * p3).extend(h), p0.extend(1.0));
    matrix.is_finite().then_some(matrix)
}

/// Pose from the homography of the unit square to the corners.
fn first_guess(corners: &[DVec2; 4], lens: &Lens, size: f64) -> Option<CvPose> {
    let square = unit_square_to(&corners.map(|corner| (corner - lens.center) / lens.focal))?;
    let (along_x, along_z) = (square.x_axis, square.y_axis);
    let middle = square.z_axis + 0.5 * (along_x + along_z);
    let scale = 2.0 * size / (along_x.length() + along_z.length());
    // Make the directions of both sides perpendicular, without preferring one.
    let (x, z) = (along_x.normalize(), along_z.normalize());
    let (sum, difference) = ((x + z).normalize(), (x - z).normalize());
    let (x, z) = ((sum + difference).normalize(), (sum - difference).normalize());
    let pose = CvPose { rotation: DMat3::from_cols(x, z.cross(x), z), translation: middle * scale };
    let is_usable = pose.translation.is_finite() && pose.rotation.is_finite() && pose.translation.z > 0.0;
    is_usable.then_some(pose)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: f64 = 0.1;

    fn webcam() -> Intrinsics {
        Intrinsics::new(Vec2::new(600.0, 605.0), Vec2::new(318.0, 243.0), UVec2::new(640, 480))
    }

    /// Pose of a camera above the desk that looks at a marker, from its distance, its tilt against the normal, and its
    /// roll.
    fn view(distance: f32, tilt: f32, roll: f32) -> Isometry3d {
        let eye = Vec3::new(distance * tilt.sin(), distance * tilt.cos(), 0.02);
        let camera = Transform::from_translation(eye).looking_at(Vec3::new(0.01, 0.0, 0.0), Vec3::NEG_Z);
        let world_from_camera = camera.to_isometry() * Isometry3d::from_rotation(Quat::from_rotation_z(roll));
        world_from_camera.inverse()
    }

    fn corners(view: &Isometry3d, shift: impl Fn(usize) -> DVec2) -> [DVec2; 4] {
        let h = 0.5 * SIZE as f32;
        let points = [Vec3::new(-h, 0.0, -h), Vec3::new(h, 0.0, -h), Vec3::new(h, 0.0, h), Vec3::new(-h, 0.0, h)];
        std::array::from_fn(|i| {
            let pixel = webcam().project(Vec3::from(view.transform_point(points[i]))).expect("in front");
            pixel.as_dvec2() + shift(i)
        })
    }

    fn assert_close(pose: &MarkerPose, truth: &Isometry3d, radians: f32, fraction: f32) {
        let turn = pose.camera_from_marker.rotation.angle_between(truth.rotation);
        let shift = pose.camera_from_marker.translation.distance(truth.translation) / truth.translation.length();
        assert!(turn < radians && shift < fraction, "off by {turn} rad and {shift} of the distance");
    }

    #[test]
    fn exact_corners_give_the_exact_pose() {
        for (distance, tilt, roll) in [(0.5, 0.6, 0.0), (0.8, 1.0, 2.0), (0.4, 0.2, -1.0), (2.0, 0.8, 3.0)] {
            let truth = view(distance, tilt, roll);
            let found =
                PoseCandidates::from_corners(&corners(&truth, |_| DVec2::ZERO), &webcam(), SIZE).expect("a pose");
            // The projection of this test rounds corners to single precision.
            assert_close(&found.best, &truth, 2e-3, 1e-3);
            assert!(found.best.reprojection_error < 1e-3);
        }
    }

    #[test]
    fn the_paper_faces_the_camera() {
        let truth = view(0.5, 0.7, 0.3);
        let found = PoseCandidates::from_corners(&corners(&truth, |_| DVec2::ZERO), &webcam(), SIZE).expect("a pose");
        for pose in [found.best, found.alternative] {
            let up = pose.camera_from_marker.rotation * Vec3::Y;
            assert!(up.dot(pose.camera_from_marker.translation.into()) < 0.0);
        }
    }

    #[test]
    fn a_far_noisy_marker_keeps_the_truth_among_its_two_poses() {
        for seed in 0..40 {
            let noise = |i: usize| {
                let at = (seed * 4 + i) as f64;
                DVec2::new((at * 12.9898).sin(), (at * 78.233).sin()) * 0.25
            };
            let truth = view(1.2, 0.35, seed as f32);
            let found = PoseCandidates::from_corners(&corners(&truth, noise), &webcam(), SIZE).expect("a pose");
            let off = |pose: &MarkerPose| pose.camera_from_marker.rotation.angle_between(truth.rotation);
            // Corners off by 0.25 px of 50 leave about 10° of tilt open; the wrong branch is 40° away.
            assert!(off(&found.best).min(off(&found.alternative)) < 0.3);
            let chosen = found.choose(Some(&truth));
            assert!(!found.is_ambiguous() || off(&chosen) < 0.3);
        }
    }

    #[test]
    fn corners_on_a_line_are_refused() {
        let line = [DVec2::ZERO, DVec2::new(10.0, 0.0), DVec2::new(20.0, 0.0), DVec2::new(30.0, 0.0)];
        assert!(PoseCandidates::from_corners(&line, &webcam(), SIZE).is_none());
    }
}
