//! The methods that make shadows.

use crate::{Lab, scene::FLOOR};
use bevy::{light::CascadeShadowConfigBuilder, prelude::*};
use bevy_mirrorball::shadows::{PlanarCasters, PlanarLights, PlanarShadow, ShadowDomeLight};

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Method {
    /// Shadow maps of the whole sky.
    #[default]
    Dome,
    /// A shadow map of the lamp, the engine's.
    Map,
    /// The casters projected onto the floor, away from the lamp's center.
    Planar,
    /// The same away from points all over the lamp, and from directions all over the sky.
    SoftPlanar,
    None,
}

/// Methods by their names on the command line.
pub(crate) const METHODS: [(&str, Method); 5] = [
    ("dome", Method::Dome),
    ("map", Method::Map),
    ("planar", Method::Planar),
    ("soft-planar", Method::SoftPlanar),
    ("none", Method::None),
];

/// Directions of the sky of soft planar shadows.
const AMBIENT: u32 = 64;

/// The entity with the dome or with the planar shadows of the floor.
#[derive(Component)]
pub(crate) struct Shadows;

/// Applies the method and its settings when they have changed.
pub(crate) fn choose_method(
    mut commands: Commands,
    lab: Res<Lab>,
    shadows: Single<Entity, With<Shadows>>,
    mut chosen: Local<Option<(Method, ShadowDomeLight)>>,
) {
    let wanted = (lab.method, lab.dome.clone());
    if chosen.as_ref() == Some(&wanted) {
        return;
    }
    let mut shadows = commands.entity(*shadows);
    let planar = |samples, ambient| PlanarShadow {
        half_size: Vec2::splat(FLOOR),
        lights: PlanarLights::Real(1),
        casters: PlanarCasters::All,
        samples,
        ambient,
        resolution: 1024,
        ..default()
    };
    match lab.method {
        Method::Dome => shadows.insert(lab.dome.clone()).remove::<PlanarShadow>(),
        Method::Planar => shadows.insert(planar(1, 0)).remove::<ShadowDomeLight>(),
        Method::SoftPlanar => {
            shadows.insert(planar(PlanarShadow::default().samples, AMBIENT)).remove::<ShadowDomeLight>()
        }
        Method::Map | Method::None => shadows.remove::<(ShadowDomeLight, PlanarShadow)>(),
    };
    *chosen = Some(wanted);
}

/// The engine's light in place of the lamp, with as many maps as the engine's default has.
pub(crate) fn lamp_with_map(direction: Vec3, color: Color, illuminance: f32) -> impl Bundle {
    (
        DirectionalLight { color, illuminance, shadow_maps_enabled: true, ..default() },
        CascadeShadowConfigBuilder { maximum_distance: 8.0, first_cascade_far_bound: 3.0, ..default() }.build(),
        Transform::from_translation(direction).looking_at(Vec3::ZERO, Vec3::Y),
    )
}
