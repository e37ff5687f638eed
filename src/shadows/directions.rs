//! Directions of a dome, and the cells of the sphere for which they stand.

use super::dome_light::DomeCoverage;
use crate::environment_map::cube_directions;
use bevy::prelude::*;
use std::sync::Arc;

/// Golden angle in radians: the difference in azimuth between successive points of a Fibonacci lattice.
pub(super) const GOLDEN_ANGLE: f32 = 2.399_963_2;
/// Minimum number of directions below the horizon of a dome whose directions are given.
const MIN_BELOW_DIRECTIONS: u32 = 16;

/// Returns unit directions on the hemisphere around +Y, which stand for equal solid angles 2π/count (Fibonacci
/// lattice). A single direction points up.
pub(super) fn hemisphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = if count == 1 { 1.0 } else { (i as f32 + 0.5) / count as f32 };
        let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * cos, height, across * sin)
    })
}

/// Returns unit directions on the whole sphere, which stand for equal solid angles 4π/count.
fn sphere(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let height = (2 * i + 1) as f32 / count as f32 - 1.0;
        let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
        let across = (1.0 - height * height).sqrt();
        Vec3::new(across * cos, height, across * sin)
    })
}

/// Unit directions among which the light is divided, in the dome's frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Directions {
    /// Directions with shadow maps.
    pub shadowed: Arc<[Vec3]>,
    /// Directions below the horizon, without shadow maps.
    pub below: Arc<[Vec3]>,
}

impl Directions {
    /// Returns evenly spread directions. Those below a hemisphere are its mirror images.
    pub(super) fn spread(coverage: DomeCoverage, count: u32) -> Self {
        match coverage {
            DomeCoverage::Hemisphere => Self {
                shadowed: hemisphere(count).collect(),
                below: hemisphere(count).map(|direction| direction.with_y(-direction.y)).collect(),
            },
            DomeCoverage::Sphere => Self { shadowed: sphere(count).collect(), below: Arc::default() },
        }
    }

    /// Returns given directions, and below the horizon at least as many that are spread evenly.
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

/// Division of the sphere into one cell per direction.
pub(super) struct Cells {
    /// Direction (in the dome's frame) and solid angle (in steradians) of small patches, grouped by cell.
    pub patches: Vec<Vec4>,
    /// Per direction: the first patch, one past the last patch, and 1 if the direction is below the horizon.
    pub ranges: Vec<UVec4>,
}

impl Cells {
    /// Assigns every patch of the sphere, which is a texel of a cube, to the nearest direction.
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
