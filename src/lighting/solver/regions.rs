//! Regions of clipped light: connected cells; large groups are split across their direction of largest variance.

use super::radiance_cells::{CELLS_PER_EDGE, RadianceCell};
use crate::environment_map::cube_directions;
use glam::{Mat3, Vec3};
use std::sync::LazyLock;

/// A group of cells of the sky.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Region {
    /// Indices of the cells.
    pub cells: Vec<usize>,
    /// Steradian.
    pub solid_angle: f32,
    /// Direction to the center, unit vector in world space.
    pub dir_world: Vec3,
    /// Root of the mean squared distance from the center, roughly radians.
    pub rms_radius: f32,
}

impl Region {
    /// Describes a group of cells, each with its weight.
    pub(super) fn new(cells: Vec<usize>, sky: &[RadianceCell], weight: &impl Fn(usize) -> f32) -> Self {
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for &i in &cells {
            sum += weight(i) * sky[i].dir_world;
            total += weight(i);
        }
        let mean = sum / total.max(f32::MIN_POSITIVE);
        let solid_angle = cells.iter().map(|&i| sky[i].solid_angle).sum();
        // The mean of unit vectors is shorter than 1 by half of their variance.
        let rms_radius = (1.0 - mean.length_squared()).max(0.0).sqrt();
        Self { cells, solid_angle, dir_world: mean.normalize_or_zero(), rms_radius }
    }

    /// Splits the region at its center, across the direction of largest variance.
    pub(super) fn split(self, sky: &[RadianceCell], weight: &impl Fn(usize) -> f32) -> [Self; 2] {
        let mut total = 0.0;
        let mut mean = Vec3::ZERO;
        for &i in &self.cells {
            mean += weight(i) * sky[i].dir_world;
            total += weight(i);
        }
        mean /= total.max(f32::MIN_POSITIVE);
        let mut covariance = Mat3::ZERO;
        for &i in &self.cells {
            let d = sky[i].dir_world - mean;
            covariance += Mat3::from_cols(d * d.x, d * d.y, d * d.z) * weight(i);
        }
        let mut axis = self.dir_world.any_orthonormal_vector() + 0.3 * self.dir_world.any_orthonormal_pair().1;
        for _ in 0..16 {
            axis = (covariance * axis).normalize_or(axis);
        }
        let (near, far) = self.cells.into_iter().partition(|&i| (sky[i].dir_world - mean).dot(axis) < 0.0);
        [Self::new(near, sky, weight), Self::new(far, sky, weight)]
    }
}

/// For each cell of a cube with [`CELLS_PER_EDGE`], the cells that share an edge or a corner with it.
static NEIGHBORS: LazyLock<Vec<Vec<usize>>> = LazyLock::new(|| {
    let cells: Vec<(Vec3, f32)> = cube_directions(CELLS_PER_EDGE).collect();
    let mut by_x: Vec<usize> = (0..cells.len()).collect();
    by_x.sort_by(|&a, &b| cells[a].0.x.total_cmp(&cells[b].0.x));
    let sorted_x: Vec<f32> = by_x.iter().map(|&i| cells[i].0.x).collect();
    let neighbors = |(i, (dir, solid_angle)): (usize, &(Vec3, f32))| {
        // Largest distance of cells that share a corner; those in the corners of a cube are the smallest.
        let reach = 1.7 * solid_angle.sqrt();
        let from = sorted_x.partition_point(|x| *x < dir.x - reach);
        let to = sorted_x.partition_point(|x| *x <= dir.x + reach);
        let is_near = |j: &usize| *j != i && cells[*j].0.distance_squared(*dir) < reach * reach;
        by_x[from..to].iter().copied().filter(is_near).collect()
    };
    cells.iter().enumerate().map(neighbors).collect()
});

/// Cells that share an edge or a corner with a cell of the sky.
pub(super) fn neighbors_of(cell: usize) -> &'static [usize] {
    &NEIGHBORS[cell]
}

/// Groups of adjacent cells.
pub(super) fn connected_groups(cells: &[usize], sky: &[RadianceCell]) -> Vec<Vec<usize>> {
    let mut is_left = vec![false; sky.len()];
    for &i in cells {
        is_left[i] = true;
    }
    let mut groups = Vec::new();
    for &first in cells.iter().rev() {
        if !std::mem::take(&mut is_left[first]) {
            continue;
        }
        let mut group = vec![first];
        let mut at = 0;
        while at < group.len() {
            for &i in neighbors_of(group[at]) {
                if std::mem::take(&mut is_left[i]) {
                    group.push(i);
                }
            }
            at += 1;
        }
        groups.push(group);
    }
    groups
}

/// Default distribution of each region's extra light over its cells, with a mean of 1 (weighted by clipped light): more
/// towards the middle of what is clipped.
pub(super) fn profiles(sky: &[RadianceCell], regions: &[Region], power: f32) -> Vec<Vec<f32>> {
    let clipped: Vec<bool> = sky.iter().map(is_clipped).collect();
    let is_edge = |i: &usize| !clipped[*i] && neighbors_of(*i).iter().any(|&j| clipped[j]);
    let edge: Vec<usize> = (0..sky.len()).filter(is_edge).collect();
    let profile = |region: &Region| {
        let depth = |i: usize| {
            let nearest = edge.iter().map(|&j| sky[j].dir_world.distance_squared(sky[i].dir_world));
            nearest.fold(4.0, f32::min).sqrt().powf(power)
        };
        let depths: Vec<f32> = region.cells.iter().map(|&i| depth(i)).collect();
        let light = |i: usize| sky[i].solid_angle * (sky[i].clipped + sky[i].limited).element_sum();
        let total: f32 = region.cells.iter().map(|&i| light(i)).sum();
        let sum: f32 = region.cells.iter().zip(&depths).map(|(&i, depth)| light(i) * depth).sum();
        depths.iter().map(|depth| depth * total / sum.max(f32::MIN_POSITIVE)).collect()
    };
    regions.iter().map(profile).collect()
}

/// Profile that distributes a region's extra light over its cells in proportion to a shape.
pub(super) fn shape_profile(region: &Region, sky: &[RadianceCell], shape: &[f32]) -> Vec<f32> {
    let clipped = |i: usize| (sky[i].clipped + sky[i].limited).element_sum();
    let typical = region.cells.iter().map(|&i| clipped(i)).fold(0.0, f32::max);
    let profile: Vec<f32> = region
        .cells
        .iter()
        .zip(shape)
        .map(|(&i, extra)| extra / clipped(i).max(MIN_CLIPPED_FRACTION * typical).max(f32::MIN_POSITIVE))
        .collect();
    let light = |i: usize| sky[i].solid_angle * clipped(i);
    let total: f32 = region.cells.iter().map(|&i| light(i)).sum();
    let sum: f32 = region.cells.iter().zip(&profile).map(|(&i, weight)| light(i) * weight).sum();
    profile.into_iter().map(|weight| weight * total / sum.max(f32::MIN_POSITIVE)).collect()
}

fn is_clipped(cell: &RadianceCell) -> bool {
    (cell.clipped + cell.limited).max_element() > MIN_CLIPPED_FRACTION * cell.seen.max_element()
}

/// Smallest clipped fraction of a cell's light at which it belongs to a region.
const MIN_CLIPPED_FRACTION: f32 = 0.25;
/// Largest root mean square radius of a region that is not split, radians.
const MAX_RMS_RADIUS: f32 = 0.16;
/// Largest number of regions, which are the unknowns of each channel.
const MAX_REGIONS: usize = 40;

/// Clipped cells above a plane, in regions of similar size.
pub(super) fn clipped_regions(sky: &[RadianceCell], up_world: Vec3) -> Vec<Region> {
    let is_above = |cell: &RadianceCell| cell.dir_world.dot(up_world) > 0.0;
    let cells: Vec<usize> = (0..sky.len()).filter(|&i| is_above(&sky[i]) && is_clipped(&sky[i])).collect();
    let weight = |i: usize| sky[i].solid_angle;
    let mut regions: Vec<Region> =
        connected_groups(&cells, sky).into_iter().map(|group| Region::new(group, sky, &weight)).collect();
    regions.sort_by(|a, b| b.solid_angle.total_cmp(&a.solid_angle));
    // The remaining regions are single pixels.
    regions.truncate(MAX_REGIONS);
    while regions.len() < MAX_REGIONS {
        let Some(widest) = (0..regions.len()).max_by(|&a, &b| regions[a].rms_radius.total_cmp(&regions[b].rms_radius))
        else {
            break;
        };
        if regions[widest].rms_radius <= MAX_RMS_RADIUS || regions[widest].cells.len() < 2 {
            break;
        }
        let halves = regions.swap_remove(widest).split(sky, &weight);
        regions.extend(halves);
    }
    regions
}
