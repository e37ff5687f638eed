//! Gains on clipped light, handed from the recovery to the unwrap pass.

use super::solver::PointLight;
use crate::environment_map::{EnvironmentCube, cube_directions};
use bevy::prelude::*;
use std::sync::Arc;

/// Gain on clipped light per direction, and a small light, on the entity of a probe. Replaces the single gain of the
/// probe's measurement.
#[derive(Component, Clone)]
pub(crate) struct ClipGains(pub(crate) Arc<Vec<Vec4>>);

impl ClipGains {
    /// Cells along an edge of the cube of gains, as in the shader, in the order of
    /// [`cube_directions`](crate::environment_map::cube_directions).
    pub(crate) const EDGE: u32 = super::solver::CELLS_PER_EDGE;
    /// Number of gains.
    const GAINS: usize = 6 * (Self::EDGE * Self::EDGE) as usize;
    /// Number of vectors: the gains, then direction and squared radius of a small light, then its radiance.
    pub(crate) const COUNT: usize = Self::GAINS + 2;
    /// Smallest radius of the spot in the cube that holds a small light, in texels in the middle of a face.
    const SPOT_TEXELS: f32 = 2.0;

    /// Gains of the cells of a solution, and its small light.
    pub(super) fn new(gains: &[Vec3], point_light: Option<PointLight>) -> Self {
        let mut list: Vec<Vec4> = gains.iter().map(|gain| gain.extend(1.0)).collect();
        let mut spot = [Vec4::ZERO; 2];
        if let Some(PointLight { direction, irradiance, angular_radius, cell, gain_behind }) = point_light {
            if let Some(gain) = list.get_mut(cell) {
                *gain = gain_behind.extend(1.0);
            }
            let squared_radius = (Self::SPOT_TEXELS * 2.0 / EnvironmentCube::SIZE as f32).max(angular_radius).powi(2);
            // Twin of `small_light` in the shader, summed over the texels, so that the spot holds all of the light.
            let texels = cube_directions(EnvironmentCube::SIZE);
            let weights = texels.map(|(dir, solid_angle)| {
                solid_angle * (1.0 - dir.distance_squared(direction) / squared_radius).max(0.0)
            });
            let radiance = irradiance / weights.sum::<f32>().max(f32::MIN_POSITIVE);
            spot = [direction.extend(squared_radius), radiance.extend(0.0)];
        }
        list.extend(spot);
        Self(Arc::new(list))
    }
}

/// Lists are never changed in place: two components are equal if they share one list.
impl PartialEq for ClipGains {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spot_of_a_small_light_holds_all_of_it() {
        for direction in [Vec3::Y, Vec3::new(0.3, 0.8, 0.5), Vec3::new(1.0, 1.0, 1.0), Vec3::new(0.4, 0.1, -0.9)] {
            let point = PointLight {
                direction: direction.normalize(),
                irradiance: Vec3::new(3.0, 2.0, 1.0),
                angular_radius: 0.0047,
                cell: 7,
                gain_behind: Vec3::splat(2.0),
            };
            let gains = ClipGains::new(&[Vec3::splat(400.0); ClipGains::GAINS], Some(point));
            assert_eq!(gains.0.len(), ClipGains::COUNT);
            assert_eq!((gains.0[6].x, gains.0[7].x, gains.0[8].x), (400.0, 2.0, 400.0));
            let [place, radiance] = [gains.0[ClipGains::GAINS], gains.0[ClipGains::GAINS + 1]];
            let texels = cube_directions(EnvironmentCube::SIZE);
            let lit = texels.map(|(dir, solid_angle)| {
                let weight = (1.0 - dir.distance_squared(place.truncate()) / place.w).max(0.0);
                radiance.truncate() * (weight * solid_angle)
            });
            let sum: Vec3 = lit.sum();
            assert!((sum / point.irradiance - 1.0).abs().max_element() < 1e-3, "{direction}: {sum}");
        }
    }
}
