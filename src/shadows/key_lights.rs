//! Choice of the key lights: the strongest real lights, which have their own shadow maps.

use super::{bounding_sphere::BoundingSphere, dome_light::DomeCoverage, view::LightView};
use crate::lighting::RealLight;
use bevy::prelude::*;
use std::f32::consts::TAU;

/// A real light in one of the dome's slots for key lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeyLight {
    id: u32,
    pub(super) view: LightView,
    /// Direction towards the light in the environment map, in world space.
    pub(super) direction_in_map: Vec3,
    pub(super) angular_radius: f32,
}

/// Minimum ratio of strengths at which another light takes over the slot of a key light.
const MIN_REPLACING_RATIO: f32 = 1.25;
/// Minimum turn of a key light from frame to frame, in radians. Smaller ones are noise.
const MIN_TURN: f32 = 0.003;
/// Minimum change of a key light's angular radius from frame to frame, as a fraction. Smaller ones are noise.
const MIN_GROWTH: f32 = 0.1;
/// Maximum angular radius of a key light, as a fraction of the radius of a direction's cell. The directions represent
/// wider lights better.
const MAX_CELL_FRACTION: f32 = 1.0;

/// What the choice of key lights depends on, besides the lights.
pub(super) struct KeySearch<'a> {
    pub(super) slots: u32,
    pub(super) directions: u32,
    pub(super) coverage: DomeCoverage,
    pub(super) up: Vec3,
    /// Position at which the light was measured.
    pub(super) measured_from: Option<Vec3>,
    pub(super) casters: Option<BoundingSphere>,
    pub(super) last: &'a [Option<KeyLight>],
}

impl KeySearch<'_> {
    /// Returns the strongest lights that are smaller than a direction's cell, by slot. Lights that were key lights
    /// before keep their slots.
    pub(super) fn choose<'l>(&self, lights: impl Iterator<Item = &'l RealLight>) -> Vec<Option<KeyLight>> {
        let whole = if self.coverage == DomeCoverage::Hemisphere { TAU } else { 2.0 * TAU };
        let cell_radius = (1.0 - whole / (TAU * self.directions.max(1) as f32)).clamp(-1.0, 1.0).acos();
        let slot_of = |id: u32| self.last.iter().position(|last| last.is_some_and(|last| last.id == id));
        let mut found: Vec<&RealLight> = lights
            .filter(|light| {
                let is_above = self.coverage == DomeCoverage::Sphere || light.direction.dot(self.up) > 0.0;
                is_above && light.direction.is_normalized() && light.angular_radius < MAX_CELL_FRACTION * cell_radius
            })
            .collect();
        let strength =
            |light: &RealLight| light.irradiance * if slot_of(light.id).is_some() { MIN_REPLACING_RATIO } else { 1.0 };
        found.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
        found.truncate(self.slots as usize);
        let mut keys = vec![None; self.slots as usize];
        let (old, new): (Vec<&RealLight>, Vec<&RealLight>) =
            found.into_iter().partition(|light| slot_of(light.id).is_some_and(|slot| slot < keys.len()));
        for light in old {
            if let Some(slot) = slot_of(light.id) {
                let key = self.key(light);
                keys[slot] = Some(self.last[slot].filter(|last| last.is_like(&key)).unwrap_or(key));
            }
        }
        let mut free: Vec<usize> = (0..keys.len()).rev().filter(|slot| keys[*slot].is_none()).collect();
        for light in new {
            if let Some(slot) = free.pop() {
                keys[slot] = Some(self.key(light));
            }
        }
        keys
    }

    fn key(&self, light: &RealLight) -> KeyLight {
        let tangent_radius = light.angular_radius.clamp(0.0, 1.0).tan();
        let near = light.position.zip(self.measured_from).and_then(|(position, measured_from)| {
            LightView::near(position, tangent_radius, measured_from, self.casters)
        });
        let view = near.unwrap_or(LightView::parallel(light.direction, tangent_radius));
        KeyLight { id: light.id, view, direction_in_map: light.direction, angular_radius: light.angular_radius }
    }
}

impl KeyLight {
    fn is_like(&self, other: &Self) -> bool {
        let is_still = match (self.view.perspective, other.view.perspective) {
            (None, None) => true,
            (Some(a), Some(b)) => {
                (a.half_size, a.near) == (b.half_size, b.near)
                    && a.position.distance(b.position) < MIN_TURN * a.measured_at
            }
            _ => false,
        };
        let growth = other.angular_radius / self.angular_radius.max(1e-6) - 1.0;
        is_still && growth.abs() < MIN_GROWTH && self.direction_in_map.angle_between(other.direction_in_map) < MIN_TURN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(id: u32, direction: Vec3, irradiance: f32, angular_radius: f32) -> RealLight {
        RealLight {
            id,
            direction: direction.normalize(),
            position: None,
            color: LinearRgba::WHITE,
            irradiance,
            angular_radius,
            fraction: 0.1,
        }
    }

    fn choose(last: &[Option<KeyLight>], lights: &[RealLight]) -> Vec<Option<KeyLight>> {
        let search = KeySearch {
            slots: 2,
            directions: 64,
            coverage: DomeCoverage::Hemisphere,
            up: Vec3::Y,
            measured_from: None,
            casters: None,
            last,
        };
        search.choose(lights.iter())
    }

    fn ids(keys: &[Option<KeyLight>]) -> Vec<Option<u32>> {
        keys.iter().map(|key| key.map(|key| key.id)).collect()
    }

    #[test]
    fn the_strongest_small_lights_above_the_horizon_are_keys_and_keep_their_places() {
        let mut lights = [
            light(1, Vec3::Y, 1.0, 0.05),
            light(2, Vec3::NEG_Y, 9.0, 0.05),
            light(3, Vec3::new(1.0, 1.0, 0.0), 9.0, 0.5),
            light(4, Vec3::new(-1.0, 1.0, 0.0), 3.0, 0.01),
            light(5, Vec3::new(0.0, 1.0, 2.0), 2.0, 0.1),
        ];
        let keys = choose(&[], &lights);
        assert_eq!(ids(&keys), [Some(4), Some(5)]);
        // Almost as strong is not enough, more is; the other one stays where it is.
        lights[0].irradiance = 2.2;
        let same = choose(&keys, &lights);
        assert_eq!(ids(&same), [Some(4), Some(5)]);
        lights[0].irradiance = 20.0;
        lights[3].irradiance = 0.1;
        assert_eq!(ids(&choose(&same, &lights)), [Some(1), Some(5)]);
        assert_eq!(ids(&choose(&same, &[])), [None, None]);
    }

    #[test]
    fn noise_does_not_turn_a_key_light_and_movement_does() {
        let keys = choose(&[], &[light(1, Vec3::Y, 1.0, 0.05)]);
        let trembling = choose(&keys, &[light(1, Vec3::new(0.001, 1.0, 0.0), 1.1, 0.052)]);
        assert_eq!(trembling, keys);
        let moved = choose(&keys, &[light(1, Vec3::new(0.01, 1.0, 0.0), 1.0, 0.05)]);
        assert_ne!(moved, keys);
    }
}
