//! Directions of the dome and how much light comes from each, for gizmos.

use super::fitted_dome::{FittedDome, Refreshing};
use bevy::{ecs::system::SystemParam, prelude::*};

/// A direction with a shadow map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DomeRay {
    /// Unit vector towards the light, in world space.
    pub direction: Vec3,
    /// Light of the direction on a scale from 0 to 1, which is that of the direction with the most light; the square
    /// root of their ratio, so that dim ones can be told apart. `None` until it is read back from the GPU.
    pub brightness: Option<f32>,
    /// Whether it is that of a key light.
    pub is_key: bool,
}

/// The directions of the dome; none without a dome.
#[derive(SystemParam)]
pub(crate) struct DomeRays<'w> {
    fitted: Option<Res<'w, FittedDome>>,
    refreshing: Option<Res<'w, Refreshing>>,
}

impl DomeRays<'_> {
    /// Center and radius of the sphere around all casters. `None` without casters.
    pub(crate) fn casters(&self) -> Option<(Vec3, f32)> {
        self.fitted.as_ref()?.sphere.map(|sphere| (sphere.center, sphere.radius))
    }

    /// Directions in the order of their shadow maps, then key lights.
    pub(crate) fn iter(&self) -> impl Iterator<Item = DomeRay> {
        let energies = self.refreshing.as_ref().map_or(&[][..], |refreshing| &refreshing.energies);
        self.fitted.iter().flat_map(move |fitted| rays(fitted, energies))
    }
}

fn rays(fitted: &FittedDome, energies: &[f32]) -> impl Iterator<Item = DomeRay> {
    let first_key = fitted.direction_count();
    // What was read back may be of another dome.
    let energies = if energies.len() == fitted.shadow_maps() as usize { energies } else { &[] };
    let most = energies.iter().take(first_key as usize).copied().fold(0.0, f32::max);
    (0..fitted.shadow_maps()).filter_map(move |index| {
        let energy = energies.get(index as usize).filter(|_| most > 0.0);
        Some(DomeRay {
            direction: fitted.view(index)?.direction,
            brightness: energy.map(|energy| (energy / most).clamp(0.0, 1.0).sqrt()),
            is_key: index >= first_key,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::{
        super::{directions::Directions, dome_light::DomeCoverage},
        *,
    };
    use std::f32::consts::FRAC_PI_2;

    #[test]
    fn rays_are_in_world_space_and_as_bright_as_their_light() {
        let mut fitted = FittedDome {
            directions: Directions::spread(DomeCoverage::Hemisphere, 1),
            world_from_dome: Quat::from_rotation_x(FRAC_PI_2),
            keys: vec![None],
            ..default()
        };
        let found: Vec<_> = rays(&fitted, &[]).collect();
        assert_eq!(found.len(), 1, "a free place for a key light is no direction");
        assert!(found[0].direction.distance(Vec3::Z) < 1e-6 && found[0].brightness.is_none());
        fitted.directions = Directions::spread(DomeCoverage::Hemisphere, 3);
        let brightness: Vec<_> = rays(&fitted, &[4.0, 1.0, 0.0, 9.0]).map(|ray| ray.brightness).collect();
        assert_eq!(brightness, [Some(1.0), Some(0.5), Some(0.0)]);
        assert!(rays(&fitted, &[1.0; 3]).all(|ray| ray.brightness.is_none()), "of another dome");
    }
}
