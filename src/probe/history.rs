//! A coarse look at the ball on the CPU: how much of the surroundings it shows now, and how they have changed.

use super::{ball_view::BallView, solids::Surroundings};
use crate::{camera::PosedFrame, environment_map::cube_directions};
use bevy::prelude::*;
use std::{f32::consts::PI, sync::Arc, time::Duration};

/// Cells along an edge of the cube of directions.
const EDGE: u32 = 6;
/// Pixels over which the view falls off beside what hides the ball; as in the shader.
const SOFT_PIXELS: f32 = 4.0;
/// Share of a direction that must be seen for it to be compared.
const MIN_SEEN_FRACTION: f32 = 0.9;
/// Changes below this are noise.
const NOISE_CHANGE: f32 = 0.02;
/// Neither exposure nor room change by more between two pictures that are to be compared.
const MAX_SCALE: f32 = 2.0;

/// What was glanced at in the newest picture, on the entity of a probe.
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct HistoryHint {
    /// Radiance in camera units (times the reflectance), and whether it is seen, for each direction.
    cells: Vec<(Vec3, f32)>,
    /// Time of the picture.
    pub captured: Duration,
    /// Mean factor by which directions that are seen have become brighter since the picture before.
    pub scale: Vec3,
    /// Mean share by which they have changed.
    pub change: f32,
    /// Share of all directions that are seen, 0…1.
    pub seen_fraction: f32,
    /// What is around the ball.
    pub surroundings: Arc<Surroundings>,
}

impl HistoryHint {
    pub(super) fn updated(
        &self,
        posed: &PosedFrame,
        captured: Duration,
        ball: &BallView,
        edge_angle: f32,
        surroundings: &Arc<Surroundings>,
    ) -> Self {
        let axis = -ball.center_camera.normalize();
        let size = posed.frame.size.as_vec2();
        let mut seen_fraction = 0.0;
        let cells: Vec<(Vec3, f32)> = cube_directions(EDGE)
            .map(|(dir_world, solid_angle)| {
                let dir = posed.camera_from_world.transform_vector3(dir_world);
                let point = ball.surface_point(dir, edge_angle);
                let Some(pixel) = posed.intrinsics.project(point) else { return (Vec3::ZERO, 0.0) };
                let inset = pixel.min(size - pixel).min_element() / SOFT_PIXELS;
                let margin = SOFT_PIXELS * -point.z / posed.intrinsics.focal.x;
                let is_shown = axis.dot(dir) > edge_angle.cos();
                let seen =
                    if is_shown { inset.clamp(0.0, 1.0) * surroundings.visibility_of(point, margin) } else { 0.0 };
                seen_fraction += seen * solid_angle / (4.0 * PI);
                (posed.frame.linear(pixel.x as i32, pixel.y as i32), seen)
            })
            .collect();
        let (mut before, mut now, mut difference) = (Vec3::splat(1e-3), Vec3::splat(1e-3), 0.0);
        for ((old, old_seen), (new, new_seen)) in self.cells.iter().zip(&cells) {
            if old_seen.min(*new_seen) > MIN_SEEN_FRACTION {
                before += *old;
                now += *new;
                difference += (*new - *old).abs().element_sum();
            }
        }
        let scale = (now / before).clamp(Vec3::splat(1.0 / MAX_SCALE), Vec3::splat(MAX_SCALE));
        let is_steady = (scale - 1.0).abs().max_element() < NOISE_CHANGE;
        Self {
            cells,
            captured,
            scale: if is_steady { Vec3::ONE } else { scale },
            change: (difference / before.max(now).element_sum() - NOISE_CHANGE).max(0.0),
            seen_fraction,
            surroundings: surroundings.clone(),
        }
    }
}
