//! The light that comes from all around: directions that stand for equal parts of it under a gray sky.

use crate::shadows::directions::{Cells, Directions, GOLDEN_ANGLE};
use bevy::prelude::*;

/// Edge of the faces of the cube whose texels are divided among the directions.
const CELL_EDGE: u32 = 32;
/// Blur of the shadows, in distances of neighboring directions on the disc below the sky. Shadows of low directions lie
/// further apart than those of high ones.
const BLUR: f32 = 0.9;

/// Returns unit directions above y = 0, each of which gives a surface that faces +Y as much light, under an even sky:
/// points spread evenly over the unit disc, raised to the sphere.
pub(super) fn directions(count: u32) -> impl Iterator<Item = Vec3> {
    (0..count).map(move |i| {
        let square = (i as f32 + 0.5) / count as f32;
        let (sin, cos) = (i as f32 * GOLDEN_ANGLE).sin_cos();
        let across = square.sqrt();
        Vec3::new(across * cos, (1.0 - square).sqrt(), across * sin)
    })
}

/// Returns the standard deviation of the blur that joins their shadows, in meters, for things at a height.
pub(super) fn blur(count: u32, height: f32) -> f32 {
    BLUR * height * (std::f32::consts::PI / count.max(1) as f32).sqrt()
}

/// Returns the parts of the sky for which the directions stand: direction and share of the irradiance of a surface that
/// faces +Y of small patches, and the first patch and one past the last of each direction.
pub(super) fn cells(count: u32) -> (Vec<Vec4>, Vec<UVec2>) {
    let above: Vec<Vec3> = directions(count).collect();
    let below = above.iter().map(|direction| direction.with_y(-direction.y)).collect();
    let Cells { patches, ranges } = Cells::new(&Directions { shadowed: above.into(), below }, CELL_EDGE);
    let lit = patches.into_iter().map(|patch| patch.with_w(patch.w * patch.y.max(0.0))).collect();
    (lit, ranges.into_iter().take(count as usize).map(|range| range.xy()).collect())
}

/// Returns the mip level of a map of this edge whose texels are about as large as the patches.
pub(super) fn level(edge: u32) -> u32 {
    (edge / (2 * CELL_EDGE)).max(1).ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::PI;

    #[test]
    fn all_directions_have_nearly_the_same_share_of_an_even_sky() {
        for count in [16, 32, 64, 128] {
            let (patches, ranges) = cells(count);
            assert_eq!(ranges.len(), count as usize);
            let shares: Vec<f32> = ranges
                .iter()
                .map(|range| patches[range.x as usize..range.y as usize].iter().map(|patch| patch.w).sum())
                .collect();
            let even = PI / count as f32;
            assert!((shares.iter().sum::<f32>() / PI - 1.0).abs() < 0.01, "{count}: {shares:?}");
            // The lowest ones share their patches with those below the horizon.
            assert!(shares.iter().all(|share| (0.3..1.8).contains(&(share / even))), "{count}: {shares:?}");
        }
    }

    #[test]
    fn directions_are_unit_vectors_above_the_receiver() {
        for direction in directions(64) {
            assert!(direction.is_normalized() && direction.y > 0.05, "{direction}");
        }
        assert_eq!(directions(0).count(), 0);
    }
}
