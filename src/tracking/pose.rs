//! Pose of a square from its four corners.
//!
//! From a distance, a square has two poses that look nearly alike: mirrored in tilt about the line of sight. The first
//! comes from the homography of the corners, the second from mirroring its axes along the line of sight; both are
//! refined by Levenberg–Marquardt on the reprojection error (compare Collins & Bartoli 2014, *Infinitesimal
//! plane-based pose estimation*). Everything is computed in double precision in the axes of computer vision (x right,
//! y down, z forward) and converted to Bevy's.

use crate::camera::Intrinsics;
use bevy::{
    math::{DMat3, DQuat, DVec2, DVec3},
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
        let square = Square::new(corners, intrinsics, size);
        let first = square.refine(square.first_guess()?)?;
        let second = square.refine(first.mirrored()).unwrap_or(first);
        let angle = first.rotation.y_axis.angle_between(second.rotation.y_axis);
        let (first, second) = (square.to_marker_pose(&first), square.to_marker_pose(&second));
        if angle < MIN_NORMAL_DIFFERENCE {
            return Some(Self { best: first, alternative: first });
        }
        let is_first_better = first.reprojection_error <= second.reprojection_error;
        let (best, alternative) = if is_first_better { (first, second) } else { (second, first) };
        Some(Self { best, alternative })
    }
}

/// A pose in the axes of computer vision.
#[derive(Clone, Copy)]
struct CvPose {
    rotation: DMat3,
    translation: DVec3,
}

impl CvPose {
    /// The second pose, which looks nearly the same: in-plane axes mirrored along the line of sight.
    fn mirrored(&self) -> Self {
        let sight = self.translation.normalize();
        let mirror = |axis: DVec3| axis - 2.0 * axis.dot(sight) * sight;
        let (x, z) = (mirror(self.rotation.x_axis), mirror(self.rotation.z_axis));
        Self { rotation: DMat3::from_cols(x, z.cross(x), z), translation: self.translation }
    }
}

struct Square<'a> {
    corners: &'a [DVec2; 4],
    points: [DVec3; 4],
    focal: DVec2,
    center: DVec2,
    size: f64,
}

impl<'a> Square<'a> {
    fn new(corners: &'a [DVec2; 4], intrinsics: &Intrinsics, size: f64) -> Self {
        let h = 0.5 * size;
        let points = [DVec3::new(-h, 0.0, -h), DVec3::new(h, 0.0, -h), DVec3::new(h, 0.0, h), DVec3::new(-h, 0.0, h)];
        Self { corners, points, focal: intrinsics.focal.as_dvec2(), center: intrinsics.center.as_dvec2(), size }
    }

    /// Pose from the homography of the unit square to the corners.
    fn first_guess(&self) -> Option<CvPose> {
        let square = unit_square_to(&self.corners.map(|corner| (corner - self.center) / self.focal))?;
        let (along_x, along_z) = (square.x_axis, square.y_axis);
        let middle = square.z_axis + 0.5 * (along_x + along_z);
        let scale = 2.0 * self.size / (along_x.length() + along_z.length());
        // Make the directions of both sides perpendicular, without preferring one.
        let (x, z) = (along_x.normalize(), along_z.normalize());
        let (sum, difference) = ((x + z).normalize(), (x - z).normalize());
        let (x, z) = ((sum + difference).normalize(), (sum - difference).normalize());
        let pose = CvPose { rotation: DMat3::from_cols(x, z.cross(x), z), translation: middle * scale };
        let is_usable = pose.translation.is_finite() && pose.rotation.is_finite() && pose.translation.z > 0.0;
        is_usable.then_some(pose)
    }

    /// Sum of squared residuals in pixels, and the normal matrix and gradient for a small rotation (about the camera's
    /// axes) and translation.
    fn linearize(&self, pose: &CvPose) -> Option<(f64, [[f64; 6]; 6], [f64; 6])> {
        let (mut cost, mut normal, mut gradient) = (0.0, [[0.0; 6]; 6], [0.0; 6]);
        for (point, corner) in self.points.iter().zip(self.corners) {
            let turned = pose.rotation * *point;
            let p = turned + pose.translation;
            if p.z <= 0.0 {
                return None;
            }
            let residual = self.center + self.focal * p.truncate() / p.z - *corner;
            cost += residual.length_squared();
            let by_point = [
                DVec3::new(self.focal.x / p.z, 0.0, -self.focal.x * p.x / (p.z * p.z)),
                DVec3::new(0.0, self.focal.y / p.z, -self.focal.y * p.y / (p.z * p.z)),
            ];
            for (row, r) in by_point.into_iter().zip([residual.x, residual.y]) {
                let by_rotation = turned.cross(row);
                let j = [by_rotation.x, by_rotation.y, by_rotation.z, row.x, row.y, row.z];
                for a in 0..6 {
                    gradient[a] += j[a] * r;
                    for b in 0..6 {
                        normal[a][b] += j[a] * j[b];
                    }
                }
            }
        }
        Some((cost, normal, gradient))
    }

    fn refine(&self, start: CvPose) -> Option<CvPose> {
        const MAX_STEPS: u32 = 30;
        const MIN_COST_DECREASE: f64 = 1e-12;
        let mut pose = start;
        let mut damping = 1e-3;
        let (mut cost, mut normal, mut gradient) = self.linearize(&pose)?;
        for _ in 0..MAX_STEPS {
            let mut damped = normal;
            for (i, row) in damped.iter_mut().enumerate() {
                row[i] *= 1.0 + damping;
            }
            let Some(step) = solve(damped, gradient.map(|g| -g)) else {
                break;
            };
            let turn = DQuat::from_scaled_axis(DVec3::new(step[0], step[1], step[2]));
            let next = CvPose {
                rotation: DMat3::from_quat((turn * DQuat::from_mat3(&pose.rotation)).normalize()),
                translation: pose.translation + DVec3::new(step[3], step[4], step[5]),
            };
            match self.linearize(&next) {
                Some((next_cost, next_normal, next_gradient)) if next_cost < cost => {
                    let gain = cost - next_cost;
                    (pose, cost, normal, gradient) = (next, next_cost, next_normal, next_gradient);
                    damping = (damping * 0.2).max(1e-12);
                    if gain < MIN_COST_DECREASE {
                        break;
                    }
                }
                _ => damping *= 8.0,
            }
        }
        Some(pose)
    }

    fn to_marker_pose(&self, pose: &CvPose) -> MarkerPose {
        let cost = self.linearize(pose).map_or(f64::MAX, |(cost, ..)| cost);
        // Bevy looks along −Z with +Y up.
        let flip = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
        let rotation = DQuat::from_mat3(&(flip * pose.rotation)).as_quat().normalize();
        let translation = (flip * pose.translation).as_vec3();
        MarkerPose {
            camera_from_marker: Isometry3d::new(translation, rotation),
            reprojection_error: (cost / 4.0).sqrt() as f32,
        }
    }
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

/// Solves a symmetric positive definite system, given by its lower triangle, by Cholesky decomposition.
pub(super) fn solve<const N: usize>(matrix: [[f64; N]; N], right: [f64; N]) -> Option<[f64; N]> {
    let mut lower = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let rest = matrix[i][j] - known;
            lower[i][j] = if i == j { (rest > 0.0).then(|| rest.sqrt())? } else { rest / lower[j][j] };
        }
    }
    let mut x = right;
    for i in 0..N {
        let known: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    for i in (0..N).rev() {
        let known: f64 = (i + 1..N).map(|k| lower[k][i] * x[k]).sum();
        x[i] = (x[i] - known) / lower[i][i];
    }
    x.iter().all(|v| v.is_finite()).then_some(x)
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
