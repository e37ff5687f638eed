//! The directions of a dome, the part of the sphere each stands for, and the box their shadow maps look at.

use super::dome_light::DomeCoverage;
use crate::environment_map::cube_directions;
use bevy::prelude::*;
use std::sync::Arc;

/// Golden angle in radians: successive points of a Fibonacci lattice are this far apart in azimuth.
const GOLDEN_ANGLE: f32 = 2.399_963_2;
/// Fewest directions below the horizon of a dome whose directions are given.
const MIN_BELOW_DIRECTIONS: u32 = 16;

/// Unit directions on the hemisphere around +Y, each standing for the same solid angle 2π/count (Fibonacci lattice). A single
/// one points up.
pub(super) fn hemisphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = if count == 1 { 1.0 } else { (i as f32 + 0.5) / count as f32 };
        let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * cos, height, across * sin)
    })
}

/// Unit directions on the whole sphere, each standing for the same solid angle 4π/count.
fn sphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = (2 * i + 1) as f32 / count as f32 - 1.0;
        let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * cos, height, across * sin)
    })
}

/// Directions that share the light between them, in the dome's frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Directions {
    /// With shadow maps.
    pub shadowed: Arc<[Vec3]>,
    /// Below the horizon, without.
    pub below: Arc<[Vec3]>,
}

impl Directions {
    /// Spread evenly; those below a hemisphere are its mirror images.
    pub(super) fn spread(coverage: DomeCoverage, count: u32) -> Self {
        match coverage {
            DomeCoverage::Hemisphere => Self {
                shadowed: hemisphere(count).collect(),
                below: hemisphere(count).map(|direction| direction.with_y(-direction.y)).collect(),
            },
            DomeCoverage::Sphere => Self { shadowed: sphere(count).collect(), below: Arc::default() },
        }
    }

    /// Given ones; below them as many are spread as they are, or more.
    pub(super) fn given(coverage: DomeCoverage, shadowed: Arc<[Vec3]>) -> Self {
        let below = match coverage {
            DomeCoverage::Hemisphere => Self::spread(coverage, (shadowed.len() as u32).max(MIN_BELOW_DIRECTIONS)).below,
            DomeCoverage::Sphere => Arc::default(),
        };
        Self { shadowed, below }
    }

    pub(super) fn all(&self) -> impl Iterator<Item = Vec3> {
        self.shadowed.iter().chain(self.below.iter()).copied()
    }
}

/// Division of the sphere among directions.
pub(super) struct Cells {
    /// Direction (dome frame) and solid angle (steradian) of small patches, those of one cell together.
    pub patches: Vec<Vec4>,
    /// First patch and one past the last, and 1 for what is below the horizon; per direction.
    pub ranges: Vec<UVec4>,
}

impl Cells {
    /// Gives every patch of the sphere, a texel of a cube, to the direction nearest to it.
    pub(super) fn new(directions: &Directions, cube_edge: u32) -> Self {
        let directions: Vec<Vec3> = directions.all().collect();
        let mut by_direction: Vec<Vec<Vec4>> = vec![Vec::new(); directions.len()];
        for (patch, solid_angle) in cube_directions(cube_edge) {
            let nearest =
                (0..directions.len()).max_by(|&a, &b| directions[a].dot(patch).total_cmp(&directions[b].dot(patch)));
            if let Some(nearest) = nearest {
                by_direction[nearest].push(patch.extend(solid_angle));
            }
        }
        let mut cells = Self { patches: Vec::new(), ranges: Vec::new() };
        for (list, direction) in by_direction.into_iter().zip(directions) {
            let start = cells.patches.len() as u32;
            cells.patches.extend(list);
            cells.ranges.push(UVec4::new(start, cells.patches.len() as u32, u32::from(direction.y < 0.0), 0));
        }
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cells_share_the_sphere_evenly() {
        for coverage in [DomeCoverage::Hemisphere, DomeCoverage::Sphere] {
            let directions = Directions::spread(coverage, 64);
            let cells = Cells::new(&directions, 64);
            let fair_share = 4.0 * std::f32::consts::PI / directions.all().count() as f32;
            let mut total = 0.0;
            for range in &cells.ranges {
                let own: f32 = cells.patches[range.x as usize..range.y as usize].iter().map(|p| p.w).sum();
                assert!((0.5..2.0).contains(&(own / fair_share)), "a cell has {} of its fair share", own / fair_share);
                total += own;
            }
            let is_below = cells.ranges.iter().map(|range| range.z);
            assert_eq!(is_below.sum::<u32>() as usize, directions.all().filter(|direction| direction.y < 0.0).count());
            assert!((total - 4.0 * std::f32::consts::PI).abs() < 5e-3);
        }
    }

    #[test]
    fn a_uniform_sky_lights_the_ground_with_pi() {
        for count in [16, 64, 256] {
            let irradiance: f32 = hemisphere(count).map(|dir| dir.y * 2.0 * std::f32::consts::PI / count as f32).sum();
            assert!((irradiance / std::f32::consts::PI - 1.0).abs() < 1e-4, "{count}: {irradiance}");
        }
    }
}
