//! The directions of a dome, the part of the sphere each stands for, and the box their shadow maps look at.

use super::DomeCoverage;
use crate::environment_map::cube_directions;
use bevy::prelude::*;
use std::sync::Arc;

/// Golden angle in radians: successive points of a Fibonacci lattice are this far apart in azimuth.
const GOLDEN_ANGLE: f32 = 2.399_963_2;
/// Fewest directions below the horizon of a dome whose directions are given.
const LEAST_BELOW: u32 = 16;
/// The last fitted sphere is kept while the casters fill at least this share of its radius.
const KEEP_FILL: f32 = 0.7;
/// Spheres have radii that are powers of this, so that casters may grow a little before they leave theirs and the texels of
/// shadow maps keep their size.
const RADIUS_STEP: f32 = 1.125;

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
            DomeCoverage::Hemisphere => Self::spread(coverage, (shadowed.len() as u32).max(LEAST_BELOW)).below,
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

/// Sphere around all casters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BoundingSphere {
    pub center: Vec3,
    pub radius: f32,
}

impl BoundingSphere {
    /// Sphere around spheres: about the middle of their common box, never empty.
    pub(super) fn around(spheres: &[BoundingSphere]) -> Option<Self> {
        let low = spheres.iter().map(|s| s.center - s.radius).reduce(Vec3::min)?;
        let high = spheres.iter().map(|s| s.center + s.radius).reduce(Vec3::max)?;
        let center = 0.5 * (low + high);
        let radius = spheres.iter().map(|s| s.center.distance(center) + s.radius).fold(0.0, f32::max);
        (center.is_finite() && radius.is_finite() && radius > 0.0).then_some(Self { center, radius })
    }

    /// The last sphere if it still holds this one without being much too large; else this one, with some room to move.
    pub(super) fn or_keep(self, last: Option<Self>) -> Self {
        match last {
            Some(last)
                if last.center.distance(self.center) + self.radius <= last.radius
                    && self.radius >= KEEP_FILL * last.radius =>
            {
                last
            }
            _ => Self { radius: RADIUS_STEP.powf((self.radius.ln() / RADIUS_STEP.ln()).ceil()), ..self },
        }
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

    #[test]
    fn a_sphere_is_kept_until_casters_leave_it_or_shrink() {
        let unit = |x: f32, radius: f32| BoundingSphere { center: Vec3::new(x, 0.0, 0.0), radius };
        assert_eq!(unit(0.05, 0.9).or_keep(Some(unit(0.0, 1.0))), unit(0.0, 1.0));
        for (left, last) in [(unit(0.2, 0.9), unit(0.0, 1.0)), (unit(0.0, 0.5), unit(0.0, 1.0))] {
            let fitted = left.or_keep(Some(last));
            assert_eq!(fitted.center, left.center);
            assert!((1.0..RADIUS_STEP + 1e-4).contains(&(fitted.radius / left.radius)), "{fitted:?}");
        }
        let both = BoundingSphere::around(&[unit(-1.0, 0.5), unit(1.0, 0.5)]).expect("not empty");
        assert_eq!(both, unit(0.0, 1.5));
        assert_eq!(BoundingSphere::around(&[]), None);
    }
}
