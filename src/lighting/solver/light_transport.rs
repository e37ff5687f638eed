//! Light transport: irradiance of sample points on the desk per radiance of the cells of the sky (Debevec et al. 2012).

use super::{
    ball_reflection::BallReflection,
    desk_frame::DeskGeometry,
    radiance_cells::RadianceCell,
    ray_cast::{PhantomSolid, SURFACE_OFFSET},
    sample_points::{MAX_PHANTOM_POINTS, SamplePoint, paper_points, phantom_points},
};
use crate::camera::Intrinsics;
use bevy::{math::Affine3A, prelude::*};

/// Sample points and the light that can reach them. Depends on where things stand, not on the light.
#[derive(Clone, Debug, Default)]
pub(super) struct LightTransport {
    pub points: Vec<SamplePoint>,
    /// Irradiance per radiance, steradian, per point and cell of the sky. Includes light by way of the balls.
    pub weights: Vec<f32>,
    /// Phantoms that occlude the sky, with the projected solid angle they take, per point.
    pub occluded: Vec<Vec<(usize, f32)>>,
    /// Mirror images of the sky in nearby balls, per point.
    pub reflections: Vec<Vec<BallReflection>>,
}

impl LightTransport {
    /// Selects points in view of the camera and traces their visibility. Reuses the memory of an earlier table.
    pub(super) fn new(
        mut memory: Vec<f32>,
        geometry: DeskGeometry,
        intrinsics: &Intrinsics,
        camera_from_world: &Affine3A,
        sky: &[RadianceCell],
    ) -> Self {
        let mut points = paper_points(geometry.papers);
        let max_points = points.len() + MAX_PHANTOM_POINTS;
        points.extend(phantom_points(geometry, intrinsics, camera_from_world));
        memory.clear();
        memory.reserve_exact(max_points * sky.len());
        let mut transport = Self { weights: memory, occluded: Vec::new(), reflections: Vec::new(), points };
        for i in 0..transport.points.len() {
            transport.trace(i, geometry, sky);
        }
        transport
    }

    fn trace(&mut self, i: usize, geometry: DeskGeometry, sky: &[RadianceCell]) {
        let point = self.points[i];
        let origin = point.pos_world + SURFACE_OFFSET * point.normal_world;
        let reflections: Vec<BallReflection> =
            geometry.balls.iter().filter_map(|ball| BallReflection::new(origin, point.normal_world, ball)).collect();
        let mut occluders: Vec<Occluder> = (geometry.phantoms.iter().enumerate())
            .filter(|(_, phantom)| phantom.casts && phantom.is_above(origin, point.normal_world))
            .map(|(index, phantom)| Occluder { index, phantom, guess: 0, projected_solid_angle: 0.0 })
            .collect();
        for cell in sky {
            let cosine = cell.dir_world.dot(point.normal_world);
            let mut weight = 0.0;
            if cosine > 0.0 && !geometry.is_hidden_by_ball(origin, cell.dir_world) {
                match nearest_occluder(&mut occluders, origin, cell.dir_world) {
                    Some(occluder) => occluder.projected_solid_angle += cosine * cell.solid_angle,
                    None => weight = cosine * cell.solid_angle,
                }
            }
            for reflection in &reflections {
                weight += reflection.weight(cell);
            }
            self.weights.push(weight);
        }
        self.reflections.push(reflections);
        self.occluded.push(
            occluders
                .iter()
                .filter(|o| o.projected_solid_angle > 0.0)
                .map(|o| (o.index, o.projected_solid_angle))
                .collect(),
        );
    }
}

/// A phantom that may hide a part of the sky from a point.
struct Occluder<'a> {
    index: usize,
    phantom: &'a PhantomSolid,
    /// Index of the triangle that was hit last.
    guess: usize,
    /// Solid angle that it hides, weighted by the cosine, steradian.
    projected_solid_angle: f32,
}

fn nearest_occluder<'b, 'a>(
    occluders: &'b mut [Occluder<'a>],
    origin: Vec3,
    dir: Vec3,
) -> Option<&'b mut Occluder<'a>> {
    let mut nearest: Option<usize> = None;
    for k in 0..occluders.len() {
        let Occluder { phantom, guess, .. } = &mut occluders[k];
        if !phantom.is_hit(origin, dir, guess) {
            continue;
        }
        // The distance matters only where one phantom stands behind another.
        let distance = |k: usize| occluders[k].phantom.hit(origin, dir).map_or(f32::MAX, |(distance, _)| distance);
        nearest = Some(nearest.filter(|&other| distance(other) <= distance(k)).unwrap_or(k));
    }
    nearest.map(|k| &mut occluders[k])
}

/// Irradiance per radiance of a cell at a point if all light of the cell comes from one direction: direct light, and
/// light by way of the balls.
pub(super) fn parallel_weight(
    geometry: DeskGeometry,
    point: &SamplePoint,
    reflections: &[BallReflection],
    cell: &RadianceCell,
    dir_world: Vec3,
) -> f32 {
    let from = point.pos_world + SURFACE_OFFSET * point.normal_world;
    let cosine = dir_world.dot(point.normal_world);
    let is_lit = cosine > 0.0 && !geometry.is_hidden(from, dir_world, &mut vec![0; geometry.phantoms.len()]);
    let direct = if is_lit { cosine * cell.solid_angle } else { 0.0 };
    let cell = RadianceCell { dir_world, ..*cell };
    direct + reflections.iter().map(|reflection| reflection.weight(&cell)).sum::<f32>()
}

/// A light at a finite distance.
pub(super) struct NearLight<'a> {
    pub geometry: DeskGeometry<'a>,
    /// Point of the ball where its rays were mirrored to the camera, world space.
    pub origin: Vec3,
    /// Distance from `origin`, meters.
    pub distance: f32,
}

impl NearLight<'_> {
    /// Irradiance per radiance of each cell at a point: direct light, in place of that from far away, and light by way
    /// of the balls.
    pub(super) fn weights(
        &self,
        point: &SamplePoint,
        reflections: &[BallReflection],
        cells: impl Iterator<Item = RadianceCell>,
    ) -> Vec<f32> {
        let from = point.pos_world + SURFACE_OFFSET * point.normal_world;
        let mut guesses = vec![0; self.geometry.phantoms.len()];
        cells
            .map(|cell| {
                let to_light = self.origin + self.distance * cell.dir_world - from;
                let distance = to_light.length().max(1e-3);
                let dir = to_light / distance;
                let solid_angle = cell.solid_angle * (self.distance / distance).powi(2);
                let cosine = dir.dot(point.normal_world);
                let is_lit = cosine > 0.0 && !self.geometry.is_hidden(from, dir, &mut guesses);
                let direct = if is_lit { cosine * solid_angle } else { 0.0 };
                direct + reflections.iter().map(|reflection| reflection.weight(&cell)).sum::<f32>()
            })
            .collect()
    }
}
