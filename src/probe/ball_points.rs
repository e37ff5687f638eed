//! Points of a ball for thousands of directions.

use super::ball_view::BallView;
use bevy::prelude::*;

/// Number of intervals of the table. Points are within 1e-5 radii of the exact ones.
const INTERVALS: usize = 256;

/// Points of a ball by mirrored direction, from a table. As [`BallView::surface_point`], at a tenth of the time.
pub(super) struct BallPoints {
    ball: BallView,
    /// Unit vector from the ball to the camera.
    axis: Vec3,
    edge_angle: f32,
    /// Angle of the surface point for mirrored angles from 0 to `edge_angle`, in equal steps.
    normal_angles: Vec<f32>,
}

impl BallPoints {
    /// Computes the table of a ball for directions up to `edge_angle` radians from the axis to the camera.
    pub(super) fn new(ball: &BallView, edge_angle: f32) -> Self {
        let normal_angle = |i: usize| ball.normal_angle(edge_angle * i as f32 / INTERVALS as f32);
        let normal_angles = (0..=INTERVALS).map(normal_angle).collect();
        Self { ball: *ball, axis: -ball.center_camera.normalize(), edge_angle, normal_angles }
    }

    /// Point of the ball (camera space) at which the camera sees the light that arrives from a direction (unit vector,
    /// camera space). Directions beyond the edge get the point at the edge on their side.
    pub(super) fn surface_point(&self, dir_camera: Vec3) -> Vec3 {
        let along = self.axis.dot(dir_camera);
        let across = dir_camera - self.axis * along;
        let length = across.length();
        let side = if length > 0.0 { across / length } else { self.axis.any_orthonormal_vector() };
        let place = length.atan2(along).min(self.edge_angle) / self.edge_angle * INTERVALS as f32;
        let first = (place as usize).min(INTERVALS - 1);
        let (below, above) = (self.normal_angles[first], self.normal_angles[first + 1]);
        let (sin, cos) = below.lerp(above, place - first as f32).sin_cos();
        self.ball.center_camera + self.ball.radius * (self.axis * cos + side * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment_map::cube_directions;

    #[test]
    fn the_table_gives_the_points_of_the_exact_solution() {
        for (center, radius) in [(Vec3::new(0.1, -0.05, -0.5), 0.05), (Vec3::new(0.0, 0.02, -0.09), 0.05)] {
            let ball = BallView { center_camera: center, radius };
            let edge_angle = 0.98 * (std::f32::consts::PI - ball.hidden_half_angle());
            let points = BallPoints::new(&ball, edge_angle);
            for (dir, _) in cube_directions(24) {
                let exact = ball.surface_point(dir, edge_angle);
                let off = points.surface_point(dir).distance(exact);
                assert!(off < 1e-5 * radius, "{dir}: off by {off} m");
            }
        }
    }
}
