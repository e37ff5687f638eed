//! Lights as entities that live as long as the real ones.

use super::{
    recover::RecoveredLight,
    solver::{FoundLight, LEAST_SHARE},
};
use bevy::prelude::*;

/// A lamp, a window or the sun, found in the environment and followed from picture to picture.
///
/// The entity appears and vanishes with the light, and keeps its [`id`](Self::id) while the light moves or flickers. Nothing is lit by it:
/// the environment map holds its light already.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::lighting::RealLight;
/// fn look_at_the_strongest(lights: Query<&RealLight>) {
///     if let Some(key) = lights.iter().max_by(|a, b| a.irradiance.total_cmp(&b.irradiance)) {
///         info!("light {} comes from {}", key.id, key.direction);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct RealLight {
    /// Number of the light, never given twice in a run.
    pub id: u32,
    /// Towards the light as seen from the ball's center, unit vector in world space.
    pub direction: Vec3,
    /// Where it is, world space, metres, if shadows and fall-off on the desk or a second ball tell; `None` while that is unknown,
    /// and for lights far away.
    pub position: Option<Vec3>,
    /// Linear color; the largest channel is 1.
    pub color: LinearRgba,
    /// Irradiance at a surface that faces the light, in its brightest channel, linear camera units: white paper there shows
    /// with `0.8 · irradiance / π`.
    pub irradiance: f32,
    /// Half the angle it takes up in the sky, in radians.
    pub angular_radius: f32,
    /// Its part of all the light that arrives at the ball, 0…1.
    pub share: f32,
}

impl RealLight {
    fn new(id: u32, found: &FoundLight) -> Self {
        let irradiance = found.irradiance.max_element().max(f32::MIN_POSITIVE);
        let color = found.irradiance / irradiance;
        Self {
            id,
            direction: found.direction,
            position: found.position,
            color: LinearRgba::rgb(color.x, color.y, color.z),
            irradiance,
            angular_radius: found.angular_radius,
            share: found.share,
        }
    }
}

/// A real light has been found; written once for each.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct RealLightAppeared {
    /// Its entity, with a [`RealLight`].
    pub entity: Entity,
    /// Its number.
    pub id: u32,
}

/// A real light has gone out or out of sight; its entity is despawned.
#[derive(Message, Clone, Copy, Debug, PartialEq)]
pub struct RealLightVanished {
    /// Its entity, as it was.
    pub entity: Entity,
    /// Its number.
    pub id: u32,
}

/// A light has to be this large a part of all light to appear; it stays while it is at least [`LEAST_SHARE`].
const APPEARS_FROM: f32 = 3.0 * LEAST_SHARE;
/// Pictures in a row without a light before it vanishes.
const PATIENCE: u32 = 5;
/// A light moves by at most this angle from picture to picture, radians.
const FARTHEST_STEP: f32 = 0.35;
/// A change of irradiance by this factor (logarithm) counts as much as the farthest step.
const BRIGHTNESS_STEP: f32 = 2.0;

/// How long a light has not been seen, and where it was going.
#[derive(Component, Clone, Copy, Default)]
pub(super) struct Sighting {
    missed: u32,
    /// Change of direction from picture to picture.
    step: Vec3,
    sequence: u64,
}

#[derive(Resource, Default)]
pub(super) struct NextLightId(u32);

pub(super) fn follow_lights(
    mut commands: Commands,
    recovered: Query<Ref<RecoveredLight>>,
    mut lights: Query<(Entity, &mut RealLight, &mut Sighting)>,
    mut next_id: ResMut<NextLightId>,
    mut appeared: MessageWriter<RealLightAppeared>,
    mut vanished: MessageWriter<RealLightVanished>,
) {
    let Some(news) = recovered.iter().next() else {
        for (entity, light, _) in &lights {
            vanished.write(RealLightVanished { entity, id: light.id });
            commands.entity(entity).despawn();
        }
        return;
    };
    if !news.is_changed() {
        return;
    }
    let mut found = news.lights.clone();
    // The best pairs first.
    let mut pairs: Vec<(f32, Entity, usize)> = lights
        .iter()
        .flat_map(|(entity, light, sighting)| {
            let expected = (light.direction + sighting.step).normalize_or(light.direction);
            found.iter().enumerate().filter_map(move |(i, new)| {
                let angle = expected.angle_between(new.direction).min(light.direction.angle_between(new.direction));
                let brightness = (new.irradiance.max_element() / light.irradiance).ln().abs();
                let cost = angle / FARTHEST_STEP + brightness / BRIGHTNESS_STEP;
                (angle < FARTHEST_STEP).then_some((cost, entity, i))
            })
        })
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = vec![false; found.len()];
    let mut matched: Vec<Entity> = Vec::new();
    for (_, entity, i) in pairs {
        if taken[i] || matched.contains(&entity) {
            continue;
        }
        let Ok((_, mut light, mut sighting)) = lights.get_mut(entity) else {
            continue;
        };
        taken[i] = true;
        matched.push(entity);
        let pictures = news.sequence.saturating_sub(sighting.sequence).clamp(1, 10) as f32;
        let step = (found[i].direction - light.direction) / pictures;
        // Steps are noisy: half of the new, half of the old.
        *sighting = Sighting { missed: 0, step: 0.5 * (sighting.step + step), sequence: news.sequence };
        light.set_if_neq(RealLight::new(light.id, &found[i]));
    }
    for (entity, light, mut sighting) in &mut lights {
        if matched.contains(&entity) {
            continue;
        }
        sighting.missed += 1;
        sighting.step = Vec3::ZERO;
        if sighting.missed > PATIENCE {
            vanished.write(RealLightVanished { entity, id: light.id });
            commands.entity(entity).despawn();
        }
    }
    let mut is_taken = taken.into_iter();
    found.retain(|_| !is_taken.next().unwrap_or(false));
    for new in found.iter().filter(|new| new.share >= APPEARS_FROM) {
        next_id.0 += 1;
        let sighting = Sighting { sequence: news.sequence, ..default() };
        let entity = commands.spawn((RealLight::new(next_id.0, new), sighting, Name::new("real light"))).id();
        appeared.write(RealLightAppeared { entity, id: next_id.0 });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::Arc, time::Duration};

    fn see(app: &mut App, sequence: u64, lights: Vec<FoundLight>) {
        let world = app.world_mut();
        let probe = world.query_filtered::<Entity, With<RecoveredLight>>().iter(world).next();
        let news =
            RecoveredLight { sequence, light: Arc::default(), lights, is_solved: true, cpu_time: Duration::ZERO };
        let probe = probe.unwrap_or_else(|| world.spawn_empty().id());
        world.entity_mut(probe).insert(news);
        app.update();
    }

    fn lamp(azimuth: f32, share: f32) -> FoundLight {
        let direction = Vec3::new(azimuth.sin(), 0.5, -azimuth.cos()).normalize();
        FoundLight { direction, position: None, irradiance: Vec3::splat(share), angular_radius: 0.05, share }
    }

    fn app() -> App {
        let mut app = App::new();
        app.add_message::<RealLightAppeared>()
            .add_message::<RealLightVanished>()
            .init_resource::<NextLightId>()
            .add_systems(Update, follow_lights);
        app
    }

    fn ids(app: &mut App) -> Vec<u32> {
        let world = app.world_mut();
        let mut ids: Vec<u32> = world.query::<&RealLight>().iter(world).map(|light| light.id).collect();
        ids.sort_unstable();
        ids
    }

    #[test]
    fn lights_keep_their_numbers_while_they_pass_each_other() {
        let mut app = app();
        for step in 0..40 {
            let across = 0.1 * step as f32;
            see(&mut app, 1 + step, vec![lamp(across, 0.5), lamp(4.0 - across + 0.03, 0.05)]);
            assert_eq!(ids(&mut app), [1, 2], "picture {step}");
        }
        let world = app.world_mut();
        let strong = world.query::<&RealLight>().iter(world).find(|light| light.id == 1).expect("still there");
        assert!(strong.irradiance > 0.4, "{strong:?}");
    }

    #[test]
    fn faint_lights_do_not_appear_but_stay_and_gone_ones_vanish_after_a_while() {
        let mut app = app();
        see(&mut app, 1, vec![lamp(0.0, 0.02)]);
        assert!(ids(&mut app).is_empty());
        see(&mut app, 2, vec![lamp(0.0, 0.04)]);
        see(&mut app, 3, vec![lamp(0.0, 0.02)]);
        assert_eq!(ids(&mut app), [1]);
        for sequence in 4..4 + u64::from(PATIENCE) {
            see(&mut app, sequence, vec![]);
            assert_eq!(ids(&mut app), [1]);
        }
        see(&mut app, 20, vec![]);
        assert!(ids(&mut app).is_empty());
        see(&mut app, 21, vec![lamp(0.0, 0.5)]);
        assert_eq!(ids(&mut app), [2], "numbers are not given twice");
    }
}
