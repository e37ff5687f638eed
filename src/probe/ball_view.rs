//! Geometry of a mirrored ball under a perspective camera: the point of the ball that shows a direction.
//!
//! Everything lies in the plane through the camera, the ball's center and the direction in question. With the ball's
//! radius r, the camera at distance D, and angles measured at the center from the axis towards the camera: the
//! surface point at angle θ is seen under the angle β off the axis, tan β = r·sin θ / (D − r·cos θ), and
//! mirrors the view into the direction φ = 2θ + β. φ grows with θ, so Newton's method finds the θ of a
//! direction φ. The silhouette is at cos θ = r/D; it shows φ = π − asin(r/D), and the cone behind it is hidden
//! by the ball itself. For D → ∞ this becomes the half-vector formula of sphere mapping, θ = φ/2, which is
//! wrong by up to several degrees on a desk.
//!
//! WGSL twin: `ball_view.wgsl`.

use super::ellipse::Ellipse;
use crate::camera::Intrinsics;
use bevy::{
    math::{DMat3, DVec2, DVec3},
    prelude::*,
};

/// Number of Newton steps. After four, the error is below 1e-6 rad for every ball farther than 1.5 radii.
const NEWTON_STEPS: u32 = 6;

/// Width of the margin inside a ball's silhouette, in pixels, whose pixels mix with the background and are not used.
pub(crate) const EDGE_MARGIN_PIXELS: f32 = 1.5;

/// Mirrored ball in the space of one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallView {
    /// Center in camera space (meters, Bevy axes).
    pub center_camera: Vec3,
    /// Radius in meters.
    pub radius: f32,
}

impl BallView {
    /// Creates the view of a ball; `None` unless the ball is entirely in front of the camera plane.
    pub fn new(center_camera: Vec3, radius: f32) -> Option<Self> {
        (radius > 0.0 && center_camera.is_finite() && center_camera.z < -radius)
            .then_some(Self { center_camera, radius })
    }

    /// Distance of the ball's center from the camera, in meters.
    pub fn distance(&self) -> f32 {
        self.center_camera.length()
    }

    /// Half angle, in radians, of the cone of directions that the ball hides behind itself, which is also the half
    /// angle of the cone in which the camera sees the ball.
    pub fn hidden_half_angle(&self) -> f32 {
        (self.radius / self.distance()).asin()
    }

    /// Mean radius of the ball in the frame, in pixels.
    pub fn radius_pixels(&self, intrinsics: &Intrinsics) -> f32 {
        let depth = -self.center_camera.z;
        self.hidden_half_angle().tan() * self.distance() / depth * intrinsics.focal.x.min(intrinsics.focal.y)
    }

    /// Angle φ, in radians, between the axis to the camera and the directions shown `margin` pixels inside the
    /// silhouette. Directions beyond it are not measured, because the rim's pixels mix with the background, and have
    /// to be filled.
    pub fn edge_angle(&self, intrinsics: &Intrinsics, margin: f32) -> f32 {
        let keep = (1.0 - margin / self.radius_pixels(intrinsics)).clamp(0.05, 1.0);
        let view_angle = (self.hidden_half_angle().tan() * keep).atan();
        // Sine rule in the triangle camera, center, surface point; the near intersection.
        let normal_angle = (self.distance() / self.radius * view_angle.sin()).min(1.0).asin() - view_angle;
        2.0 * normal_angle + view_angle
    }

    /// Angle θ of the surface point that mirrors the direction at an angle φ from the axis. Both are in radians; φ
    /// is at most π − [`hidden_half_angle`](Self::hidden_half_angle).
    pub fn normal_angle(&self, mirrored_angle: f32) -> f32 {
        let distance = self.distance() / self.radius;
        let mut theta = 0.5 * mirrored_angle * (1.0 - 0.5 / distance);
        for _ in 0..NEWTON_STEPS {
            let (sin, cos) = theta.sin_cos();
            let view_angle = sin.atan2(distance - cos);
            let slope = 2.0 + (distance * cos - 1.0) / (distance * distance + 1.0 - 2.0 * distance * cos);
            theta -= (2.0 * theta + view_angle - mirrored_angle) / slope;
        }
        theta
    }

    /// Point of the ball (camera space) at which the camera sees the light that arrives from a direction (unit vector,
    /// camera space). Directions beyond `edge_angle` get the point at `edge_angle` on their side.
    pub fn surface_point(&self, dir_camera: Vec3, edge_angle: f32) -> Vec3 {
        let axis = -self.center_camera.normalize();
        let along = axis.dot(dir_camera);
        let across = dir_camera - axis * along;
        let side = across.normalize_or(axis.any_orthonormal_vector());
        let mirrored_angle = across.length().atan2(along).min(edge_angle);
        let (sin, cos) = self.normal_angle(mirrored_angle).sin_cos();
        self.center_camera + self.radius * (axis * cos + side * sin)
    }

    /// Direction of the light that the ball mirrors into a view ray (both unit vectors in camera space); `None` if
    /// the ray misses the ball.
    pub fn mirrored_direction(&self, ray_camera: Vec3) -> Option<Vec3> {
        let along = ray_camera.dot(self.center_camera);
        let discriminant = along * along - self.center_camera.length_squared() + self.radius * self.radius;
        (discriminant >= 0.0 && along > 0.0).then(|| {
            let normal = (ray_camera * (along - discriminant.sqrt()) - self.center_camera) / self.radius;
            ray_camera.reflect(normal)
        })
    }

    /// Outline of the ball in the frame.
    pub fn outline(&self, intrinsics: &Intrinsics) -> Ellipse {
        // Rays d that touch the ball satisfy (d·c)² = (|c|² − r²)·|d|², a conic dᵀQd = 0 with d = A·(u, v,
        // 1).
        let c = self.center_camera.as_dvec3();
        let q = DMat3::from_cols(c * c.x, c * c.y, c * c.z)
            - DMat3::from_diagonal(DVec3::splat(c.length_squared() - f64::from(self.radius).powi(2)));
        let (f, p) = (intrinsics.focal.as_dvec2(), intrinsics.center.as_dvec2());
        let ray_from_pixel = DMat3::from_cols_array(&[
            1.0 / f.x,
            0.0,
            0.0, //
            0.0,
            -1.0 / f.y,
            0.0, //
            -p.x / f.x,
            p.y / f.y,
            -1.0,
        ]);
        let m = ray_from_pixel.transpose() * q * ray_from_pixel;
        let (a, b, d) = (m.x_axis.x, m.x_axis.y, m.y_axis.y);
        let (gx, gy) = (m.z_axis.x, m.z_axis.y);
        let det = a * d - b * b;
        let center = DVec2::new((b * gy - d * gx) / det, (b * gx - a * gy) / det);
        let at_center = m.z_axis.z + gx * center.x + gy * center.y;
        // In centered coordinates xᵀSx = −at_center; S has the axes' directions as eigenvectors and −at_center
        // / length² as eigenvalues. The sign is normalized so that both are positive and the smaller one belongs to
        // the longer axis.
        let sign = if a + d < 0.0 { -1.0 } else { 1.0 };
        let (a, b, d, level) = (sign * a, sign * b, sign * d, -sign * at_center);
        let (mean, spread) = (0.5 * (a + d), (0.25 * (a - d).powi(2) + b * b).sqrt());
        Ellipse {
            center: center.as_vec2(),
            semi_axes: Vec2::new((level / (mean - spread)).sqrt() as f32, (level / (mean + spread)).sqrt() as f32),
            angle: (0.5 * f64::atan2(-2.0 * b, d - a)) as f32,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn webcam() -> Intrinsics {
        Intrinsics::new(Vec2::new(1300.0, 1300.0), Vec2::new(640.0, 360.0), UVec2::new(1280, 720))
    }

    fn directions() -> impl Iterator<Item = Vec3> {
        (0..4000).map(|i| {
            let z = 1.0 - 2.0 * (i as f32 + 0.5) / 4000.0;
            let azimuth = i as f32 * 2.399_963;
            let s = (1.0 - z * z).sqrt();
            Vec3::new(s * azimuth.cos(), s * azimuth.sin(), z)
        })
    }

    /// Ray tracer: the mirrored direction of the ray from the camera through a point. Nearly grazing rays need double
    /// precision.
    fn trace(ball: &BallView, through: Vec3) -> Option<Vec3> {
        let (ray, center) = (through.as_dvec3().normalize(), ball.center_camera.as_dvec3());
        let along = ray.dot(center);
        let discriminant = along * along - center.length_squared() + f64::from(ball.radius).powi(2);
        (discriminant >= 0.0).then(|| ray.reflect((ray * (along - discriminant.sqrt()) - center).normalize()).as_vec3())
    }

    /// Accuracy that unwrapping requires of direction ↔ pixel everywhere, in radians.
    const MAX_ANGLE_ERROR: f32 = 0.02 * std::f32::consts::PI / 180.0;

    #[test]
    fn every_visible_direction_is_found_where_a_ray_tracer_sees_it() {
        for distance in [0.12, 0.3, 0.75, 5.0] {
            let ball = BallView::new(Vec3::new(0.2, -0.1, -1.0).normalize() * distance, 0.05).expect("in front");
            let visible = std::f32::consts::PI - ball.hidden_half_angle();
            let axis = -ball.center_camera.normalize();
            let mut seen = 0;
            for dir in directions() {
                // At the very silhouette the mirrored direction changes infinitely fast with the pixel.
                if axis.dot(dir).acos() > visible - 0.01 {
                    continue;
                }
                let point = ball.surface_point(dir, visible);
                let back = trace(&ball, point).expect("hits the ball");
                // For such small angles the chord equals the angle, without the rounding error of an arc cosine.
                assert!(back.distance(dir) < MAX_ANGLE_ERROR, "{distance} m: {dir} came back as {back}");
                seen += 1;
            }
            assert!(seen > 3000);
        }
    }

    #[test]
    fn hidden_directions_take_the_rim_on_their_side() {
        let ball = BallView::new(Vec3::new(0.0, 0.0, -0.5), 0.05).expect("in front");
        let edge = ball.edge_angle(&webcam(), 1.5);
        assert!(edge < std::f32::consts::PI - ball.hidden_half_angle());
        let behind = Vec3::new(0.01, 0.0, -1.0).normalize();
        let point = ball.surface_point(behind, edge);
        assert!(point.x > 0.0 && point.y.abs() < 1e-6);
        let pixel = webcam().project(point).expect("in front");
        let rim = webcam().center.x + ball.radius_pixels(&webcam());
        assert!((rim - pixel.x - 1.5).abs() < 0.1, "{} px inside", rim - pixel.x);
    }

    #[test]
    fn the_outline_encloses_exactly_the_rays_that_hit() {
        let ball = BallView::new(Vec3::new(0.25, -0.12, -0.6), 0.05).expect("in front");
        let outline = ball.outline(&webcam());
        let mut on_both_sides = [0, 0];
        for i in 0..60 {
            for j in 0..60 {
                let pixel = outline.center + (Vec2::new(i as f32, j as f32) / 29.5 - 1.0) * outline.semi_axes.x * 1.3;
                let local = Vec2::from_angle(-outline.angle).rotate(pixel - outline.center) / outline.semi_axes;
                if (local.length() - 1.0).abs() < 2e-3 {
                    continue;
                }
                let hit = ball.mirrored_direction(webcam().ray(pixel)).is_some();
                assert_eq!(hit, outline.contains(pixel), "at {pixel}, {outline:?}");
                on_both_sides[usize::from(hit)] += 1;
            }
        }
        assert!(on_both_sides.into_iter().all(|n| n > 500));
        assert!(outline.semi_axes.x > outline.semi_axes.y * 1.02, "an off-axis ball is seen as an ellipse");
    }
}
