//! Bundle adjustment: intrinsics, distortion and the pose of each view together.

use super::CalibrationPoint;
use crate::{camera::distortion::BrownConrady, least_squares::NormalEquations};
use bevy::math::{DMat2, DMat3, DQuat, DVec2, DVec3};

/// Intrinsics in double precision. Pixels as in [`Intrinsics`](crate::camera::Intrinsics).
#[derive(Clone, Copy, Debug)]
pub(super) struct Camera {
    pub focal: DVec2,
    pub center: DVec2,
    pub lens: BrownConrady,
}

/// Place of the board in camera space: x right, y down, z forward; the board's x right, y down, z into the paper.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub rotation: DMat3,
    pub translation: DVec3,
}

/// Unknowns of the camera: focal lengths, principal point, distortion in the order of its coefficients.
const CAMERA_UNKNOWNS: usize = 9;
/// Unknowns of a view: rotation and translation.
const POSE_UNKNOWNS: usize = 6;
/// Unknowns of the camera that are adjusted first, as the others would make up for wrong poses: focal lengths and k1.
pub(super) const FIRST_UNKNOWNS: [usize; 3] = [0, 1, 4];
/// All unknowns of the camera.
pub(super) const ALL_UNKNOWNS: [usize; CAMERA_UNKNOWNS] = [0, 1, 2, 3, 4, 5, 6, 7, 8];

/// Largest number of steps, of which 10 to 20 are needed.
const MAX_STEPS: usize = 60;
/// Relative change of the sum of squares at which the steps end.
const TOLERANCE: f64 = 1e-10;

impl Camera {
    /// Pixel at which the lens shows a point of the board; `None` beside or behind the camera.
    pub(super) fn project(&self, pose: &Pose, board: DVec2) -> Option<DVec2> {
        let at = pose.rotation * board.extend(0.0) + pose.translation;
        (at.z > 1e-6).then(|| self.center + self.focal * self.lens.distort(at.truncate() / at.z))
    }

    /// Distance in pixels of a point from where it was seen; infinite behind the camera.
    pub(super) fn error(&self, pose: &Pose, point: &CalibrationPoint) -> f64 {
        self.project(pose, point.board).map_or(f64::INFINITY, |at| at.distance(point.frame))
    }

    /// Derivatives of the pixel of a point by the unknowns of the camera and those of its view.
    fn derivatives(&self, pose: &Pose, board: DVec2) -> [DVec2; CAMERA_UNKNOWNS + POSE_UNKNOWNS] {
        let turned = pose.rotation * board.extend(0.0);
        let at = turned + pose.translation;
        let point = at.truncate() / at.z;
        let seen = self.lens.distort(point);
        let by_point = DMat2::from_diagonal(self.focal) * self.lens.by_point(point);
        let by_place = |change: DVec3| by_point * ((change.truncate() - point * change.z) / at.z);
        let [k1, k2, p1, p2, k3] = BrownConrady::by_coefficients(point).map(|by| self.focal * by);
        let [turn_x, turn_y, turn_z] = DVec3::AXES.map(|axis| by_place(axis.cross(turned)));
        let [move_x, move_y, move_z] = DVec3::AXES.map(by_place);
        let (by_focal_x, by_focal_y) = (DVec2::X * seen.x, DVec2::Y * seen.y);
        [by_focal_x, by_focal_y, DVec2::X, DVec2::Y, k1, k2, p1, p2, k3, turn_x, turn_y, turn_z, move_x, move_y, move_z]
    }
}

/// The state of an adjustment.
#[derive(Clone, Debug)]
pub(super) struct Adjustment {
    pub camera: Camera,
    pub poses: Vec<Pose>,
}

impl Adjustment {
    /// Levenberg–Marquardt (Marquardt 1963) over the poses and some unknowns of the camera. Errors above `scale`
    /// pixels count linearly (Huber 1964).
    pub(super) fn adjust(&mut self, views: &[Vec<CalibrationPoint>], unknowns: &[usize], scale: f64) {
        let mut cost = self.cost(views, scale);
        let mut damping = 1e-3;
        for _ in 0..MAX_STEPS {
            let equations = self.equations(views, scale);
            let mut is_better = false;
            while damping < 1e9 {
                let Some(next) = self.stepped(equations.clone(), unknowns, damping) else {
                    damping *= 10.0;
                    continue;
                };
                let next_cost = next.cost(views, scale);
                if next_cost < cost {
                    let change = (cost - next_cost) / cost;
                    (*self, cost) = (next, next_cost);
                    damping = (damping * 0.1).max(1e-12);
                    is_better = change > TOLERANCE;
                    break;
                }
                damping *= 10.0;
            }
            if !is_better {
                return;
            }
        }
    }

    /// Standard deviations of the focal lengths in pixels, as the scatter of the points tells them. Infinite if the
    /// views do not determine them.
    pub(super) fn focal_deviation(&self, views: &[Vec<CalibrationPoint>]) -> f64 {
        let equations = self.equations(views, f64::INFINITY);
        let unknowns = CAMERA_UNKNOWNS + POSE_UNKNOWNS * self.poses.len();
        let numbers = 2 * views.iter().map(Vec::len).sum::<usize>();
        let variance = self.cost(views, f64::INFINITY) / numbers.saturating_sub(unknowns).max(1) as f64;
        equations.inverse().map_or(f64::INFINITY, |inverse| {
            let of = |i: usize| (variance * inverse[i * unknowns + i]).sqrt();
            let deviation = of(0).max(of(1));
            if deviation.is_nan() { f64::INFINITY } else { deviation }
        })
    }

    fn cost(&self, views: &[Vec<CalibrationPoint>], scale: f64) -> f64 {
        let of_error = |error: f64| if error <= scale { error * error } else { scale * (2.0 * error - scale) };
        let of_view = |(view, pose): (&Vec<CalibrationPoint>, &Pose)| {
            view.iter().map(|point| of_error(self.camera.error(pose, point))).sum::<f64>()
        };
        views.iter().zip(&self.poses).map(of_view).sum()
    }

    /// Normal equations of the next step.
    fn equations(&self, views: &[Vec<CalibrationPoint>], scale: f64) -> NormalEquations {
        let mut equations = NormalEquations::new(CAMERA_UNKNOWNS + POSE_UNKNOWNS * self.poses.len());
        for (i, (view, pose)) in views.iter().zip(&self.poses).enumerate() {
            let first = CAMERA_UNKNOWNS + POSE_UNKNOWNS * i;
            let index = |k: usize| if k < CAMERA_UNKNOWNS { k } else { first + k - CAMERA_UNKNOWNS };
            for point in view {
                let Some(at) = self.camera.project(pose, point.board) else {
                    continue;
                };
                let miss = point.frame - at;
                let weight = (scale / miss.length()).min(1.0);
                let derivatives = self.camera.derivatives(pose, point.board);
                for (axis, miss) in [(DVec2::X, miss.x), (DVec2::Y, miss.y)] {
                    let row: [(usize, f64); CAMERA_UNKNOWNS + POSE_UNKNOWNS] =
                        std::array::from_fn(|k| (index(k), derivatives[k].dot(axis)));
                    equations.add(&row, miss, weight);
                }
            }
        }
        equations
    }

    fn stepped(&self, mut equations: NormalEquations, unknowns: &[usize], damping: f64) -> Option<Self> {
        for i in 0..CAMERA_UNKNOWNS + POSE_UNKNOWNS * self.poses.len() {
            let is_fixed = i < CAMERA_UNKNOWNS && !unknowns.contains(&i);
            // An unknown without any influence stays too.
            let stiffness = if is_fixed { 1e12 } else { damping };
            equations.add(&[(i, 1.0)], 0.0, stiffness * equations.diagonal(i) + 1e-12);
        }
        let step = equations.solve_unbounded()?;
        let mut next = self.clone();
        let camera = &mut next.camera;
        camera.focal += DVec2::new(step[0], step[1]);
        camera.center += DVec2::new(step[2], step[3]);
        camera.lens.coefficients.iter_mut().zip(&step[4..]).for_each(|(coefficient, step)| *coefficient += step);
        for (pose, step) in next.poses.iter_mut().zip(step[CAMERA_UNKNOWNS..].chunks_exact(POSE_UNKNOWNS)) {
            let turn = DQuat::from_scaled_axis(DVec3::new(step[0], step[1], step[2]));
            let rotation = turn * DQuat::from_mat3(&pose.rotation);
            pose.rotation = DMat3::from_quat(rotation.normalize());
            pose.translation += DVec3::new(step[3], step[4], step[5]);
        }
        camera_is_possible(&next.camera).then_some(next)
    }
}

fn camera_is_possible(camera: &Camera) -> bool {
    camera.focal.is_finite() && camera.focal.min_element() > 0.0 && camera.center.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Distortion;

    #[test]
    fn derivatives_are_those_of_the_projection() {
        let lens = BrownConrady::from(Distortion { k1: -0.2, k2: 0.05, p1: 0.002, p2: -0.001, k3: 0.01 });
        let camera = Camera { focal: DVec2::new(500.0, 510.0), center: DVec2::new(321.0, 239.0), lens };
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(0.4, -0.3, 0.2)));
        let state = Adjustment { camera, poses: vec![Pose { rotation, translation: DVec3::new(-0.05, 0.02, 0.4) }] };
        let board = DVec2::new(0.08, 0.05);
        let at = |state: &Adjustment| state.camera.project(&state.poses[0], board).expect("in view");
        for (i, derivative) in camera.derivatives(&state.poses[0], board).into_iter().enumerate() {
            // A step of this size along one unknown.
            let size = 1e-6;
            let stepped = |size: f64| {
                let mut equations = NormalEquations::new(15);
                (0..15).for_each(|k| equations.add(&[(k, 1.0)], if k == i { size } else { 0.0 }, 1.0));
                state.stepped(equations, &ALL_UNKNOWNS, 0.0).expect("possible")
            };
            let change = (at(&stepped(size)) - at(&stepped(-size))) / (2.0 * size);
            assert!((change - derivative).length() < 1e-4 * (1.0 + derivative.length()), "{i}: {change}, {derivative}");
        }
    }
}
