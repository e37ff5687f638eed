//! Mirror image of the surroundings in the ball, resampled to the cells of a cube, with the clipped part of each cell.

use super::desk_frame::MirrorBall;
use crate::{
    camera::PosedFrame,
    environment_map::cube_directions,
    probe::{BallSurface, BallView, EDGE_MARGIN_PIXELS, gain_limits},
};
use glam::{Vec2, Vec3};

/// Cells along an edge of the cube that light is solved on; 2.8° each.
pub(crate) const CELLS_PER_EDGE: u32 = 32;

/// Radiance of the surroundings in one direction, as the ball shows it, linear camera units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RadianceCell {
    /// Direction to the cell, world space.
    pub dir_world: Vec3,
    /// Steradian.
    pub solid_angle: f32,
    /// Radiance if clipped light is white.
    pub seen: Vec3,
    /// Clipped part of `seen`, whose gain is unlimited.
    pub clipped: Vec3,
    /// Clipped part of `seen`, whose gain is at most `limit`.
    pub limited: Vec3,
    /// Largest gain of `limited`; at least 1.
    pub limit: Vec3,
}

impl RadianceCell {
    /// Radiance if clipped light is multiplied by a gain per channel.
    pub(super) fn radiance(&self, gain: Vec3) -> Vec3 {
        self.seen + (gain - 1.0) * self.clipped + (gain.min(self.limit) - 1.0).max(Vec3::ZERO) * self.limited
    }
}

/// Table of angles, in place of [`BallView::surface_point`] for many directions.
struct SurfacePointTable {
    center_camera: Vec3,
    /// Direction from the ball to the camera.
    axis: Vec3,
    radius: f32,
    /// Sine of half of the largest mirrored angle.
    last: f32,
    /// Sine and cosine of the angle of the ball's normal, evenly spaced up to `last` in the sine of half of the
    /// mirrored angle.
    normals: Vec<Vec2>,
}

impl SurfacePointTable {
    const STEPS: usize = 512;

    fn new(ball: &BallView, edge_angle: f32) -> Self {
        let last = (0.5 * edge_angle).sin();
        let normal = |step: usize| {
            let mirrored_angle = 2.0 * (step as f32 / Self::STEPS as f32 * last).asin();
            Vec2::from(ball.normal_angle(mirrored_angle).sin_cos())
        };
        Self {
            center_camera: ball.center_camera,
            axis: -ball.center_camera.normalize(),
            radius: ball.radius,
            last,
            normals: (0..=Self::STEPS).map(normal).collect(),
        }
    }

    fn at(&self, dir_camera: Vec3) -> Vec3 {
        let along = self.axis.dot(dir_camera);
        let side = (dir_camera - self.axis * along).normalize_or(self.axis.any_orthonormal_vector());
        let step = ((0.5 - 0.5 * along).max(0.0).sqrt() / self.last).min(1.0) * Self::STEPS as f32;
        let i = (step as usize).min(Self::STEPS - 1);
        let normal = self.normals[i].lerp(self.normals[i + 1], step - i as f32);
        self.center_camera + self.radius * (self.axis * normal.y + side * normal.x)
    }
}

/// A mirrored ball in a posed frame.
#[derive(Clone, Copy)]
pub(super) struct BallInFrame<'a> {
    pub posed: PosedFrame<'a>,
    pub ball: &'a BallView,
    /// Fraction of light that the ball mirrors at normal incidence.
    pub reflectance: f32,
    pub surface: BallSurface,
}

impl<'a> BallInFrame<'a> {
    pub(super) fn new(posed: PosedFrame<'a>, ball: &MirrorBall, view: &'a BallView) -> Self {
        Self { posed, ball: view, reflectance: ball.reflectance, surface: ball.surface }
    }

    /// Radiance of the surroundings in cells, in the order of [`cube_directions`].
    pub(super) fn radiance_cells(&self, edge: u32) -> Vec<RadianceCell> {
        const SUBSAMPLES: u32 = 2;
        let edge_angle = self.ball.edge_angle(&self.posed.intrinsics, EDGE_MARGIN_PIXELS);
        let points = SurfacePointTable::new(self.ball, edge_angle);
        cube_directions(edge)
            .map(|(dir_world, solid_angle)| {
                let mut cell = RadianceCell { dir_world, solid_angle, ..Default::default() };
                let step = solid_angle.sqrt() / SUBSAMPLES as f32;
                let (right, up) = dir_world.any_orthonormal_pair();
                let mut limits = Vec3::ZERO;
                for i in 0..SUBSAMPLES * SUBSAMPLES {
                    let across = (Vec2::new((i % SUBSAMPLES) as f32, (i / SUBSAMPLES) as f32)
                        - 0.5 * (SUBSAMPLES - 1) as f32)
                        * step;
                    let dir = (dir_world + across.x * right + across.y * up).normalize();
                    let dir_camera = self.posed.camera_from_world.transform_vector3(dir);
                    let point = points.at(dir_camera);
                    if let Some(pixel) = self.posed.intrinsics.project(point) {
                        let weight = 1.0 / (SUBSAMPLES * SUBSAMPLES) as f32;
                        self.add_bilinear(&mut cell, &mut limits, pixel, weight / self.sensitivity_at(point));
                    }
                }
                cell.limit = Vec3::from_array(std::array::from_fn(|c| {
                    if cell.limited[c] > 0.0 { limits[c] / cell.limited[c] } else { 1.0 }
                }));
                cell
            })
            .collect()
    }

    /// Radiance in a direction if clipped light is white; `None` where the ball does not show it.
    pub(super) fn radiance(&self, dir_world: Vec3, edge_angle: f32) -> Option<Vec3> {
        let dir_camera = self.posed.camera_from_world.transform_vector3(dir_world);
        if (-self.ball.center_camera).angle_between(dir_camera) > edge_angle {
            return None;
        }
        let point = self.ball.surface_point(dir_camera, edge_angle);
        let (mut cell, mut limits) = (RadianceCell::default(), Vec3::ZERO);
        self.add_bilinear(
            &mut cell,
            &mut limits,
            self.posed.intrinsics.project(point)?,
            1.0 / self.sensitivity_at(point),
        );
        Some(cell.seen)
    }

    /// Fraction of light that a point of the ball (camera space) mirrors to the camera.
    pub(super) fn reflectance_at(&self, point_camera: Vec3) -> f32 {
        let normal = (point_camera - self.ball.center_camera) / self.ball.radius;
        self.surface.reflectance_at(self.reflectance, -normal.dot(point_camera.normalize_or_zero()))
    }

    /// Pixel value per unit of radiance that is mirrored at a point of the ball.
    fn sensitivity_at(&self, point_camera: Vec3) -> f32 {
        self.posed.exposure * self.reflectance_at(point_camera)
    }

    fn add_bilinear(&self, cell: &mut RadianceCell, limits: &mut Vec3, pixel: Vec2, weight: f32) {
        for (bilinear, value) in self.posed.bilinear(pixel) {
            let part = weight * bilinear * value;
            cell.seen += part;
            for (c, limit) in gain_limits(value).into_iter().enumerate() {
                match limit {
                    Some(f32::INFINITY) => cell.clipped[c] += part[c],
                    Some(limit) => {
                        cell.limited[c] += part[c];
                        limits[c] += part[c] * limit;
                    }
                    None => {}
                }
            }
        }
    }
}

/// Index of the cell of a cube that contains a world direction, in the order of [`cube_directions`]. Twin of `sky_cell`
/// in `clip_gains.wgsl`.
pub(super) fn cell_index(dir_world: Vec3, edge: u32) -> usize {
    let size = dir_world.abs();
    let axis = if size.x >= size.y && size.x >= size.z { 0 } else { 2 - u32::from(size.y >= size.z) };
    let (along, a, b) = match axis {
        0 => (dir_world.x, dir_world.y, dir_world.z),
        1 => (dir_world.y, dir_world.x, dir_world.z),
        _ => (dir_world.z, dir_world.x, dir_world.y),
    };
    let face = 2 * axis + u32::from(along < 0.0);
    let place = |v: f32| (((v / along.abs() * 0.5 + 0.5) * edge as f32) as u32).min(edge - 1);
    ((face * edge + place(b)) * edge + place(a)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_is_found_by_its_direction() {
        for (i, (dir, _)) in cube_directions(CELLS_PER_EDGE).enumerate() {
            assert_eq!(cell_index(dir, CELLS_PER_EDGE), i, "{dir}");
        }
    }

    #[test]
    fn points_of_the_ball_from_the_table_are_those_that_are_solved_for() {
        let ball = BallView { center_camera: Vec3::new(0.1, -0.15, -0.6), radius: 0.05 };
        let edge_angle = 2.7;
        let points = SurfacePointTable::new(&ball, edge_angle);
        for (dir, _) in cube_directions(CELLS_PER_EDGE) {
            let off = points.at(dir).distance(ball.surface_point(dir, edge_angle));
            assert!(off < 1e-3 * ball.radius, "{dir}: {off}");
        }
    }
}
