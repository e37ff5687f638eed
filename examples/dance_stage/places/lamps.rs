//! Lamps of a place: its sun and its spot lights, and what casts shadows in their light.

use super::{Place, PlaceRoot};
use bevy::{
    camera::Exposure,
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap, NotShadowCaster},
    prelude::*,
};
use std::f32::consts::PI;

/// Range of spot lights in meters: further than the stones that they light. The files say none.
const SPOT_RANGE: f32 = 60.0;
/// How much brighter than in the files they are, so that they show against the sky.
const SPOT_GAIN: f32 = 1.6;
/// Edge of the shadow map of a cascade in texels, distances in meters at which the cascades end.
const SHADOW_MAP: usize = 1024;
const CASCADES: [f32; 2] = [12.0, 48.0];
/// Beginnings of the names of nodes that cast no shadows: ground, which lies below all else, blades of grass, of which
/// there are too many, and what is beyond the reach of the shadow maps.
const NO_CASTERS: [&str; 8] = ["meadow", "grass", "tree line", "paving", "lawn", "stage", "far blocks", "cloud"];

/// Light of a place's sun.
pub(super) struct Sun {
    /// What a white surface that faces it shows of it, in frame buffer units.
    pub shown: Vec3,
}

impl Sun {
    pub(super) fn of(place: Place) -> Self {
        let shown = match place {
            Place::Stonehenge => Vec3::new(2.4, 1.45, 0.75),
            Place::Campus => Vec3::new(0.63, 0.59, 0.51),
        };
        Self { shown }
    }

    /// The lamp, for a camera of some exposure.
    pub(super) fn lamp(&self, turn: Quat, exposure: &Exposure) -> impl Bundle {
        let strength = self.shown.max_element();
        let color = Color::LinearRgba(LinearRgba::from_vec3(self.shown / strength));
        // A matte white surface shows irradiance ÷ π.
        let illuminance = PI * strength / exposure.exposure();
        let [first_cascade_far_bound, maximum_distance] = CASCADES;
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: CASCADES.len(),
            first_cascade_far_bound,
            maximum_distance,
            ..default()
        };
        (
            DirectionalLight { color, illuminance, shadow_maps_enabled: true, ..default() },
            Transform::from_rotation(turn),
            cascades.build(),
        )
    }
}

/// Size of the sun's shadow maps.
pub(super) fn shadow_map() -> DirectionalLightShadowMap {
    DirectionalLightShadowMap { size: SHADOW_MAP }
}

/// Lets the spot lights of a scene reach its stones and cast shadows.
pub(super) fn prepare_spots(mut spots: Query<&mut SpotLight, Added<SpotLight>>) {
    for mut spot in &mut spots {
        spot.intensity *= SPOT_GAIN;
        spot.range = SPOT_RANGE;
        spot.shadow_maps_enabled = true;
    }
}

/// Takes the ground and all that is small or far out of the shadow maps.
pub(super) fn choose_casters(
    mut commands: Commands,
    new: Query<(Entity, &ChildOf), Added<Mesh3d>>,
    nodes: Query<(&Name, &ChildOf)>,
    roots: Query<(), With<PlaceRoot>>,
    parents: Query<&ChildOf>,
) {
    for (mesh, node) in &new {
        let Ok((name, _)) = nodes.get(node.parent()) else {
            continue;
        };
        let is_in_place = parents.iter_ancestors(mesh).any(|above| roots.contains(above));
        if is_in_place && NO_CASTERS.iter().any(|start| name.starts_with(start)) {
            commands.entity(mesh).insert(NotShadowCaster);
        }
    }
}
