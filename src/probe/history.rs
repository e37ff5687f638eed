//! Hints for the temporal history of the environment: which fraction of the surroundings a ball shows, and how much
//! they have changed since the frame before. They come from a coarse grid of directions on the CPU.

use super::{ball_view::BallView, solids::Surroundings};
use crate::{camera::PosedFrame, environment_map::cube_directions};
use bevy::prelude::*;
use std::{f32::consts::PI, sync::Arc, time::Duration};

/// Number of directions along each edge of the cube of directions.
const EDGE: u32 = 6;
/// Distance in pixels over which visibility falls off beside whatever hides the ball, as in `frame_sampling.wgsl`.
const SOFT_PIXELS: f32 = 4.0;
/// Visibility from which a direction is compared between two frames.
const MIN_SEEN_FRACTION: f32 = 0.9;
/// Relative change up to which a difference counts as noise.
const NOISE_CHANGE: f32 = 0.02;
/// Upper bound of the factor between two frames; neither the exposure nor the room changes by more.
const MAX_SCALE: f32 = 2.0;

/// Summary of the newest frame for the aging of the history, on the entity of a ball.
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct HistoryHint {
    /// For each direction the radiance in camera units (times the reflectance), and its visibility, 0…1.
    cells: Vec<(Vec3, f32)>,
    /// Time at which the frame was captured.
    pub captured: Duration,
    /// Mean factor by which the visible directions have become brighter since the frame before.
    pub scale: Vec3,
    /// Mean relative change of the visible directions since the frame before.
    pub change: f32,
    /// Fraction of all directions that are visible, 0…1.
    pub seen_fraction: f32,
    /// Solids around the ball.
    pub surroundings: Arc<Surroundings>,
}

impl HistoryHint {
    /// Returns the hint of a frame, compared with this one of the frame before.
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
