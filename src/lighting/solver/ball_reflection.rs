//! Light that a mirrored ball reflects onto the surfaces beside it.

use super::{desk_frame::MirrorBall, radiance_cells::RadianceCell};
use crate::probe::BallView;
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Mirror image of the sky in a ball, as seen from a point near it.
#[derive(Clone, Debug)]
pub(super) struct BallReflection {
    /// Direction from the ball to the point.
    axis: Vec3,
    /// Surface normal at the point.
    normal: Vec3,
    /// Cosine of the largest angle to the axis at which the ball still mirrors the sky. Beyond it, the ball is in its
    /// own way.
    min_along: f32,
    /// Images, evenly spaced over 0…1 in the sine of half of the angle to the axis.
    images: [ReflectedImage; STEPS + 1],
}

/// Mirror image of the sky at one angle.
#[derive(Clone, Copy, Debug, Default)]
struct ReflectedImage {
    /// Solid angle of the image relative to that of the sky, times the fraction of light that is mirrored.
    scale: f32,
    /// Sine and cosine of the angle between the image and the ball's center, as seen from the point.
    view: Vec2,
}

const STEPS: usize = 160;
/// Largest distance in radii of the ball. Beyond it, the mirror image contributes less than about 1 % of the light.
const MAX_DISTANCE_RADII: f32 = 6.0;

impl BallReflection {
    /// Computes the reflection at a point; `None` if the ball is too far away.
    pub(super) fn new(origin: Vec3, normal: Vec3, ball: &MirrorBall) -> Option<Self> {
        let to_ball = ball.center - origin;
        let distance = to_ball.length();
        if distance > MAX_DISTANCE_RADII * ball.radius || distance <= 1.001 * ball.radius {
            return None;
        }
        let view = BallView { center_camera: Vec3::new(0.0, 0.0, -distance), radius: ball.radius };
        let last = PI - view.hidden_half_angle();
        let image = |step: usize| {
            let angle = (2.0 * (step as f32 / STEPS as f32).asin()).min(last);
            ReflectedImage::new(distance / ball.radius, angle, view.normal_angle(angle), ball.reflectance)
        };
        let axis = -to_ball / distance;
        Some(Self { axis, normal, min_along: last.cos(), images: std::array::from_fn(image) })
    }

    /// Irradiance by reflection per radiance of a cell, steradian.
    pub(super) fn weight(&self, cell: &RadianceCell) -> f32 {
        let along = self.axis.dot(cell.dir_world);
        if along <= self.min_along {
            return 0.0;
        }
        let step = (0.5 - 0.5 * along).max(0.0).sqrt() * STEPS as f32;
        let i = (step as usize).min(STEPS - 1);
        let t = step - i as f32;
        let (from, to) = (&self.images[i], &self.images[i + 1]);
        let view = from.view + t * (to.view - from.view);
        // Direction to the image of the cell: away from the axis on the cell's side, and back along the axis.
        let up = self.normal.dot(self.axis);
        let across = (self.normal.dot(cell.dir_world) - along * up) / (1.0 - along * along).max(1e-6).sqrt();
        let cosine = across * view.x - up * view.y;
        cell.solid_angle * (from.scale + t * (to.scale - from.scale)) * cosine.max(0.0)
    }
}

impl ReflectedImage {
    /// Image at an angle to the axis at which the ball's normal turns by `theta`. The distance of the point is in
    /// radii.
    fn new(distance: f32, angle: f32, theta: f32, reflectance: f32) -> Self {
        let (sin, cos) = theta.sin_cos();
        let view_angle = sin.atan2(distance - cos);
        // Demagnification: dβ/dφ along the direction from the axis, sin β / sin φ across it.
        let slope = (distance * cos - 1.0) / (distance * distance + 1.0 - 2.0 * distance * cos);
        let along_axis = (slope / (2.0 + slope)).max(0.0);
        let across = if angle > 1e-3 { view_angle.sin() / angle.sin().max(1e-3) } else { along_axis };
        Self { scale: reflectance * along_axis * across, view: Vec2::from(view_angle.sin_cos()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{environment_map::cube_directions, probe::BallSurface};

    /// The truth is the sum over mirrored rays from the point to the ball, under a tinted sky.
    #[test]
    fn a_uniform_sky_arrives_as_rays_over_the_ball_say() {
        let ball = MirrorBall {
            center: Vec3::new(0.1, 0.05, 0.0),
            radius: 0.05,
            reflectance: 0.9,
            surface: BallSurface::Mirror,
        };
        let reflection = BallReflection::new(Vec3::ZERO, Vec3::Y, &ball).expect("near");
        let tinted = |dir: Vec3| 1.0 + 0.5 * dir.x + 0.3 * dir.z;
        let ours: f32 = cube_directions(32)
            .map(|(dir_world, solid_angle)| {
                tinted(dir_world) * reflection.weight(&RadianceCell { dir_world, solid_angle, ..Default::default() })
            })
            .sum();
        let view = BallView { center_camera: ball.center, radius: ball.radius };
        let truth: f32 = cube_directions(128)
            .filter_map(|(ray, solid_angle)| {
                let reflection = view.mirrored_direction(ray)?;
                Some(0.9 * tinted(reflection) * solid_angle * ray.y.max(0.0))
            })
            .sum();
        assert!((ours / truth - 1.0).abs() < 0.02, "{ours} {truth}");
        assert!(BallReflection::new(Vec3::new(-0.4, 0.0, 0.0), Vec3::Y, &ball).is_none());
    }
}
