//! Output of the solver: the sky with its clipped parts recovered.

use super::{
    detect_lights::{DetectedLight, detect_lights},
    radiance_cells::RadianceCell,
    regions::{Region, neighbors_of},
};
use crate::luminance::luminance;
use bevy::reflect::TypePath;
use glam::Vec3;
use std::f32::consts::PI;

/// A clipped region of the sky and its solution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedRegion {
    /// Direction to its center, unit vector in world space.
    pub direction: Vec3,
    /// Steradian.
    pub solid_angle: f32,
    /// Gain relative to white, per channel; at least 1.
    pub gain: Vec3,
    /// Position in world space, meters, if fanning shadows and fall-off on the desk show that the light is near. `None`
    /// for distant light.
    pub position: Option<Vec3>,
    /// Fraction of the solution that the equations determine, 0…1. The rest comes from the prior, least extra light.
    pub confidence: f32,
}

/// Light of the surroundings with its clipped parts recovered.
#[derive(TypePath, Clone, Debug, Default, PartialEq)]
pub struct SolvedLight {
    /// Clipped regions.
    pub regions: Vec<SolvedRegion>,
    /// Gain on clipped light in the direction of each cell of a cube.
    pub gains: Vec<Vec3>,
    /// Number of compared points, including those of the paper.
    pub points: usize,
    /// Number of these points that are on markers' paper.
    pub paper_points: usize,
    /// Root mean square of the relative difference between the desk as explained by the light and as it is (robust).
    pub residual: f32,
    /// Number of clipped regions whose light a darker ball or a bracketed exposure shows.
    pub bracketed_regions: usize,
    /// Irradiance of the paper as explained by the light ÷ as it is, per channel.
    pub paper_ratio: Vec3,
    /// Ratio of the largest to the smallest scale of the equations; large where regions cannot be distinguished.
    pub condition: f32,
    pub(super) sky: Vec<RadianceCell>,
    /// A small light whose direction the shadows on the desk show.
    pub(in crate::lighting) point_light: Option<PointLight>,
    /// Mean of the points' robust costs.
    pub(super) cost: f64,
}

/// A light far smaller than a cell of the sky, in one of the cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::lighting) struct PointLight {
    /// Unit vector, world space.
    pub direction: Vec3,
    /// Irradiance at a surface that faces it, linear camera units (radiance · steradian).
    pub irradiance: Vec3,
    /// Half of the angle that it subtends, radians.
    pub angular_radius: f32,
    /// Index of the cell in whose gain the light is counted.
    pub cell: usize,
    /// Gain of the cell without the light.
    pub gain_behind: Vec3,
}

/// Largest angle between a small light and a detected one that is the same, radians: half the diagonal of a cell.
const MAX_CELL_OFFSET: f32 = 0.05;

/// Largest distance between a light's rim and a region that counts as the same light, radians.
const MAX_REGION_OFFSET: f32 = 0.07;

impl SolvedLight {
    /// The sky in small cells: direction (world space, unit), solid angle in steradian, and radiance in linear camera
    /// units with clipped light recovered.
    pub fn sky(&self) -> impl Iterator<Item = (Vec3, f32, Vec3)> {
        self.sky.iter().zip(&self.gains).map(|(cell, gain)| (cell.dir_world, cell.solid_angle, cell.radiance(*gain)))
    }

    /// Irradiance ÷ π at an unoccluded surface with a normal (world space, unit), linear camera units: the radiance of
    /// a white surface of that orientation.
    pub fn irradiance(&self, normal_world: Vec3) -> Vec3 {
        let lit =
            self.sky().map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal_world).max(0.0)));
        lit.sum::<Vec3>() / PI
    }

    /// Compact parts of the sky that are much brighter than the rest, strongest first, with the positions that the desk
    /// reveals.
    pub fn lights(&self) -> Vec<DetectedLight> {
        let mut lights = detect_lights(&self.sky, &self.gains);
        for light in &mut lights {
            let angle = |region: &SolvedRegion| region.direction.angle_between(light.direction);
            let nearest = self.regions.iter().min_by(|a, b| angle(a).total_cmp(&angle(b)));
            let is_part = |region: &&SolvedRegion| angle(region) < light.angular_radius + MAX_REGION_OFFSET;
            light.position = nearest.filter(is_part).and_then(|region| region.position);
        }
        if let Some(point) = &self.point_light {
            let is_other = |light: &DetectedLight| {
                light.direction.angle_between(point.direction) > light.angular_radius + MAX_CELL_OFFSET
            };
            lights.retain(is_other);
            let total: f32 = self.sky().map(|(_, solid_angle, radiance)| luminance(radiance) * solid_angle).sum();
            lights.push(DetectedLight {
                direction: point.direction,
                position: None,
                irradiance: point.irradiance,
                angular_radius: point.angular_radius,
                fraction: luminance(point.irradiance) / total.max(f32::MIN_POSITIVE),
            });
            lights.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
        }
        lights
    }
}

/// Rings of cells around a region that take its gain, because the edge of the light runs through them.
const DILATION_ROUNDS: usize = 2;

/// Gain of every cell of the sky, from the gains of the regions.
pub(super) fn cell_gains(
    sky: &[RadianceCell],
    regions: &[Region],
    profiles: &[Vec<f32>],
    gains: &[Vec3],
    up_world: Vec3,
) -> Vec<Vec3> {
    let mut all = vec![None; sky.len()];
    for ((region, profile), gain) in regions.iter().zip(profiles).zip(gains) {
        for (&i, weight) in region.cells.iter().zip(profile) {
            all[i] = Some(1.0 + *weight * (*gain - 1.0));
        }
    }
    for _ in 0..DILATION_ROUNDS {
        let before = all.clone();
        for i in (0..sky.len()).filter(|&i| before[i].is_none() && sky[i].dir_world.dot(up_world) > 0.0) {
            let distance = |j: &usize| sky[*j].dir_world.distance_squared(sky[i].dir_world);
            let known = neighbors_of(i).iter().filter(|j| before[**j].is_some());
            let nearest = known.min_by(|a, b| distance(a).total_cmp(&distance(b)));
            all[i] = nearest.and_then(|&j| before[j]);
        }
    }
    all.into_iter().map(|gain| gain.unwrap_or(Vec3::ONE)).collect()
}
