//! What comes out of the solver: the sky with its clipped parts recovered.

use super::{
    detect_lights::{DetectedLight, detect_lights},
    radiance_cells::RadianceCell,
    regions::{Region, neighbors_of},
};
use bevy::prelude::*;
use std::f32::consts::PI;

/// One piece of the sky that the camera clipped, and what it was found to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolvedRegion {
    /// Towards its middle, unit vector in world space.
    pub direction: Vec3,
    /// Steradian.
    pub solid_angle: f32,
    /// How many times brighter than white, per channel; at least 1.
    pub gain: Vec3,
    /// Where it is, world space, metres, if the desk tells that it is near: shadows fan out and light falls off. `None` far away.
    pub position: Option<Vec3>,
    /// Share of the answer that the equations fix, 0…1; the rest is the prior, least extra light.
    pub confidence: f32,
}

/// Light whose clipped parts have been recovered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SolvedLight {
    /// The clipped pieces.
    pub regions: Vec<SolvedRegion>,
    /// Gain on clipped light towards each cell of a cube.
    pub gains: Vec<Vec3>,
    /// Points that were compared, those of the paper included.
    pub points: usize,
    /// Of these, points of markers' paper.
    pub paper_points: usize,
    /// Root of the mean squared relative difference between the desk as the light explains it and as it is (robust).
    pub residual: f32,
    /// Clipped pieces whose light a darker ball or a shorter exposure shows.
    pub bracketed_regions: usize,
    /// The paper as the light explains it ÷ as it is, per channel.
    pub paper_ratio: Vec3,
    /// Ratio of the largest to the smallest scale of the equations; large where regions cannot be told apart.
    pub condition: f32,
    pub(super) sky: Vec<RadianceCell>,
}

/// A light and a region this close are the same, radians beyond the light's radius.
const MAX_REGION_OFFSET: f32 = 0.07;

impl SolvedLight {
    /// The sky in small pieces: direction (world space, unit), steradian, radiance in linear camera units with clipped light
    /// recovered.
    pub fn sky(&self) -> impl Iterator<Item = (Vec3, f32, Vec3)> {
        self.sky.iter().zip(&self.gains).map(|(cell, gain)| (cell.dir_world, cell.solid_angle, cell.radiance(*gain)))
    }

    /// Irradiance ÷ π at a surface that sees all of the sky about its normal (world space, unit), linear camera units: what a
    /// white surface of that orientation would shine with.
    pub fn irradiance(&self, normal_world: Vec3) -> Vec3 {
        let lit =
            self.sky().map(|(dir, solid_angle, radiance)| radiance * (solid_angle * dir.dot(normal_world).max(0.0)));
        lit.sum::<Vec3>() / PI
    }

    /// Compact parts of the sky that are much brighter than the rest, strongest first, with the places that the desk tells of.
    pub fn lights(&self) -> Vec<DetectedLight> {
        let mut lights = detect_lights(&self.sky, &self.gains);
        for light in &mut lights {
            let angle = |region: &SolvedRegion| region.direction.angle_between(light.direction);
            let nearest = self.regions.iter().min_by(|a, b| angle(a).total_cmp(&angle(b)));
            let is_part = |region: &&SolvedRegion| angle(region) < light.angular_radius + MAX_REGION_OFFSET;
            light.position = nearest.filter(is_part).and_then(|region| region.position);
        }
        lights
    }
}

/// Cells beside a region take its gain, since its edge runs through them: twice around.
const DILATION_ROUNDS: usize = 2;

/// Gain of every cell of the sky from those of the regions.
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
