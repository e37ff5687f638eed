//! Fit of a pose to points whose pixels are known: Levenberg–Marquardt on the reprojection error, in double precision
//! and in the axes of computer vision (x right, y down, z forward).

use crate::camera::Intrinsics;
use bevy::{
    math::{DMat3, DQuat, DVec2, DVec3},
    prelude::*,
};

/// Bevy looks along −Z with +Y up.
const BEVY_FROM_CV: DMat3 = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));

/// Pose of something in the axes of computer vision: its frame → camera frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct CvPose {
    pub(super) rotation: DMat3,
    pub(super) translation: DVec3,
}

impl CvPose {
    /// The second pose, which looks nearly the same: in-plane axes mirrored along the line of sight.
    pub(super) fn mirrored(&self) -> Self {
        let sight = self.translation.normalize();
        let mirror = |axis: DVec3| axis - 2.0 * axis.dot(sight) * sight;
        let (x, z) = (mirror(self.rotation.x_axis), mirror(self.rotation.z_axis));
        Self { rotation: DMat3::from_cols(x, z.cross(x), z), translation: self.translation }
    }

    /// The pose in Bevy's camera axes.
    pub(super) fn to_isometry(self) -> Isometry3d {
        let rotation = DQuat::from_mat3(&(BEVY_FROM_CV * self.rotation)).as_quat().normalize();
        Isometry3d::new((BEVY_FROM_CV * self.translation).as_vec3(), rotation)
    }

    /// A pose in Bevy's camera axes.
    pub(super) fn from_isometry(pose: &Isometry3d) -> Self {
        let rotation = BEVY_FROM_CV * DMat3::from_quat(pose.rotation.as_dquat());
        Self { rotation, translation: BEVY_FROM_CV * Vec3::from(pose.translation).as_dvec3() }
    }
}

/// The pinhole that pixels come from.
#[derive(Clone, Copy)]
pub(super) struct Lens {
    pub(super) focal: DVec2,
    pub(super) center: DVec2,
}

impl From<&Intrinsics> for Lens {
    fn from(intrinsics: &Intrinsics) -> Self {
        Self { focal: intrinsics.focal.as_dvec2(), center: intrinsics.center.as_dvec2() }
    }
}

/// A point, the pixel where it is seen, and how much it counts.
#[derive(Clone, Copy)]
pub(super) struct PointPair {
    pub(super) point: DVec3,
    pub(super) pixel: DVec2,
    pub(super) weight: f64,
}

impl PointPair {
    pub(super) fn new(point: DVec3, pixel: DVec2) -> Self {
        Self { point, pixel, weight: 1.0 }
    }
}

/// Weighted root mean square distance in pixels between points and their reprojections; infinite for a pose with a
/// point behind the camera.
pub(super) fn error(pairs: &[PointPair], lens: &Lens, pose: &CvPose) -> f64 {
    let weights: f64 = pairs.iter().map(|pair| pair.weight).sum();
    linearize(pairs, lens, pose).map_or(f64::INFINITY, |(cost, ..)| (cost / weights.max(f64::MIN_POSITIVE)).sqrt())
}

/// Weighted sum of squared residuals in pixels, and the normal matrix and gradient for a small rotation (about the
/// camera's axes) and translation.
fn linearize(pairs: &[PointPair], lens: &Lens, pose: &CvPose) -> Option<(f64, [[f64; 6]; 6], [f64; 6])> {
    let (mut cost, mut normal, mut gradient) = (0.0, [[0.0; 6]; 6], [0.0; 6]);
    for PointPair { point, pixel, weight } in pairs {
        let turned = pose.rotation * *point;
        let p = turned + pose.translation;
        if p.z <= 0.0 {
            return None;
        }
        let residual = lens.center + lens.focal * p.truncate() / p.z - *pixel;
        cost += weight * residual.length_squared();
        let by_point = [
            DVec3::new(lens.focal.x / p.z, 0.0, -lens.focal.x * p.x / (p.z * p.z)),
            DVec3::new(0.0, lens.focal.y / p.z, -lens.focal.y * p.y / (p.z * p.z)),
        ];
        for (row, r) in by_point.into_iter().zip([residual.x, residual.y]) {
            let by_rotation = turned.cross(row);
            let j = [by_rotation.x, by_rotation.y, by_rotation.z, row.x, row.y, row.z];
            for a in 0..6 {
                gradient[a] += weight * j[a] * r;
                for b in 0..6 {
                    normal[a][b] += weight * j[a] * j[b];
                }
            }
        }
    }
    Some((cost, normal, gradient))
}

/// The pose near `start` with the least weighted sum of squared distances.
pub(super) fn refine(pairs: &[PointPair], lens: &Lens, start: CvPose) -> Option<CvPose> {
    const MAX_STEPS: u32 = 30;
    const MIN_COST_DECREASE: f64 = 1e-12;
    let mut pose = start;
    let mut damping = 1e-3;
    let (mut cost, mut normal, mut gradient) = linearize(pairs, lens, &pose)?;
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
        match linearize(pairs, lens, &next) {
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
