//! Lights as entities that live as long as the real lights.

use super::{
    recover::RecoveredLight,
    solver::{DetectedLight, MIN_LIGHT_FRACTION},
};
use bevy::prelude::*;

/// A lamp, window or sun that is detected in the environment and tracked from frame to frame.
///
/// The entity is spawned and despawned with the light and keeps its [`id`](Self::id) while the light moves or flickers.
/// It lights nothing: the environment map already contains its light.
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
    /// Number of the light; never reused in a run.
    pub id: u32,
    /// Direction to the light from the center of the ball, unit vector in world space.
    pub direction: Vec3,
    /// Position in world space, meters, if shadows and fall-off on the desk or a second ball reveal it. `None` while it
    /// is unknown, and for distant lights.
    pub position: Option<Vec3>,
    /// Linear color; the largest channel is 1.
    pub color: LinearRgba,
    /// Irradiance at a surface that faces the light, in its brightest channel, linear camera units: white paper there
    /// has the pixel value `0.8 · irradiance / π`.
    pub irradiance: f32,
    /// Half of the angle that the light subtends, radians.
    pub angular_radius: f32,
    /// Fraction of all light that arrives at the ball, 0…1.
    pub fraction: f32,
}

impl RealLight {
    fn new(id: u32, detected: &DetectedLight) -> Self {
        let irradiance = detected.irradiance.max_element().max(f32::MIN_POSITIVE);
        let color = detected.irradiance / irradiance;
        Self {
            id,
            direction: detected.direction,
            position: detected.position,
            color: LinearRgba::rgb(color.x, color.y, color.z),
            irradiance,
            angular_radius: detected.angular_radius,
            fraction: detected.fraction,
        }
    }
}

/// Event that a real light has been detected: triggered on its new entity, once per light, and written as a message.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::lighting::{RealLight, RealLightAppeared, RealLightVanished};
/// # let mut app = App::new();
/// app.add_observer(|appeared: On<RealLightAppeared>, lights: Query<&RealLight>| {
///     if let Ok(light) = lights.get(appeared.entity) {
///         info!("light {} shines from {}", light.id, light.direction);
///     }
/// });
/// app.add_observer(|vanished: On<RealLightVanished>| info!("light {} is gone", vanished.id));
/// ```
#[derive(EntityEvent, Message, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Message, Debug, Clone, PartialEq)]
pub struct RealLightAppeared {
    /// Entity of the light, with a [`RealLight`].
    pub entity: Entity,
    /// Number of the light.
    pub id: u32,
}

/// Event that a real light has gone out or out of sight: triggered on its entity, which is despawned right after, and
/// written as a message. There is an example at [`RealLightAppeared`].
#[derive(EntityEvent, Message, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Message, Debug, Clone, PartialEq)]
pub struct RealLightVanished {
    /// Entity of the light. It is gone when the message is read.
    pub entity: Entity,
    /// Number of the light.
    pub id: u32,
}

/// Smallest fraction of all light at which a light appears. It then stays as long as it has [`MIN_LIGHT_FRACTION`].
const MIN_APPEARING_FRACTION: f32 = 3.0 * MIN_LIGHT_FRACTION;
/// Most consecutive frames without a light before it vanishes.
const MAX_MISSED_FRAMES: u32 = 5;
/// Largest angle by which a light moves from frame to frame, radians.
const MAX_STEP: f32 = 0.35;
/// Change of irradiance (natural logarithm of the ratio) that costs as much as the largest step.
const LOG_BRIGHTNESS_STEP: f32 = 2.0;

/// Motion of a light, and the frames since it was last detected.
#[derive(Component, Clone, Copy, Default)]
pub(super) struct LightTrack {
    missed_frames: u32,
    /// Change of direction per frame.
    step: Vec3,
    /// Sequence number of the newest frame with the light.
    sequence: u64,
}

#[derive(Resource, Default)]
pub(super) struct NextLightId(u32);

/// Matches detected lights with known ones; spawns and despawns the others.
pub(super) fn track_lights(
    mut commands: Commands,
    recovered: Query<Ref<RecoveredLight>>,
    mut lights: Query<(Entity, &mut RealLight, &mut LightTrack)>,
    mut next_id: ResMut<NextLightId>,
    mut appeared: MessageWriter<RealLightAppeared>,
    mut vanished: MessageWriter<RealLightVanished>,
) {
    let Some(recovered) = recovered.iter().next() else {
        for (entity, light, _) in &lights {
            lose(&mut commands, &mut vanished, entity, light);
        }
        return;
    };
    if !recovered.is_changed() {
        return;
    }
    let mut detected = recovered.lights.clone();
    let pairs = pairs_by_cost(lights.iter(), &detected);
    let mut taken = vec![false; detected.len()];
    let mut matched: Vec<Entity> = Vec::new();
    for (_, entity, i) in pairs {
        if taken[i] || matched.contains(&entity) {
            continue;
        }
        let Ok((_, mut light, mut track)) = lights.get_mut(entity) else {
            continue;
        };
        taken[i] = true;
        matched.push(entity);
        let frames = recovered.sequence.saturating_sub(track.sequence).clamp(1, 10) as f32;
        let step = (detected[i].direction - light.direction) / frames;
        // Steps are noisy: the mean of the old and the new one smooths them.
        *track = LightTrack { missed_frames: 0, step: 0.5 * (track.step + step), sequence: recovered.sequence };
        light.set_if_neq(RealLight::new(light.id, &detected[i]));
    }
    for (entity, light, mut track) in &mut lights {
        if matched.contains(&entity) {
            continue;
        }
        track.missed_frames += 1;
        track.step = Vec3::ZERO;
        if track.missed_frames > MAX_MISSED_FRAMES {
            lose(&mut commands, &mut vanished, entity, &light);
        }
    }
    let mut is_taken = taken.into_iter();
    detected.retain(|_| !is_taken.next().unwrap_or(false));
    for new in detected.iter().filter(|new| new.fraction >= MIN_APPEARING_FRACTION) {
        next_id.0 += 1;
        let track = LightTrack { sequence: recovered.sequence, ..default() };
        let entity = commands.spawn((RealLight::new(next_id.0, new), track, Name::new("real light"))).id();
        let event = RealLightAppeared { entity, id: next_id.0 };
        commands.trigger(event);
        appeared.write(event);
    }
}

/// Announces that a light is gone, and despawns it.
fn lose(commands: &mut Commands, vanished: &mut MessageWriter<RealLightVanished>, entity: Entity, light: &RealLight) {
    let event = RealLightVanished { entity, id: light.id };
    commands.trigger(event);
    commands.entity(entity).despawn();
    vanished.write(event);
}

/// Pairs of a known and a detected light that may be the same, with their cost; the best pairs first.
fn pairs_by_cost<'a>(
    lights: impl Iterator<Item = (Entity, &'a RealLight, &'a LightTrack)>,
    detected: &[DetectedLight],
) -> Vec<(f32, Entity, usize)> {
    let mut pairs: Vec<(f32, Entity, usize)> = lights
        .flat_map(|(entity, light, track)| {
            let expected = (light.direction + track.step).normalize_or(light.direction);
            detected.iter().enumerate().filter_map(move |(i, new)| {
                let angle = expected.angle_between(new.direction).min(light.direction.angle_between(new.direction));
                let brightness = (new.irradiance.max_element() / light.irradiance).ln().abs();
                let cost = angle / MAX_STEP + brightness / LOG_BRIGHTNESS_STEP;
                (angle < MAX_STEP).then_some((cost, entity, i))
            })
        })
        .collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::Arc, time::Duration};

    fn see(app: &mut App, sequence: u64, lights: Vec<DetectedLight>) {
        let world = app.world_mut();
        let probe = world.query_filtered::<Entity, With<RecoveredLight>>().iter(world).next();
        let recovered =
            RecoveredLight { sequence, light: Arc::default(), lights, is_solved: true, cpu_time: Duration::ZERO };
        let probe = probe.unwrap_or_else(|| world.spawn_empty().id());
        world.entity_mut(probe).insert(recovered);
        app.update();
    }

    fn lamp(azimuth: f32, fraction: f32) -> DetectedLight {
        let direction = Vec3::new(azimuth.sin(), 0.5, -azimuth.cos()).normalize();
        DetectedLight { direction, position: None, irradiance: Vec3::splat(fraction), angular_radius: 0.05, fraction }
    }

    fn app() -> App {
        let mut app = App::new();
        app.add_message::<RealLightAppeared>()
            .add_message::<RealLightVanished>()
            .init_resource::<NextLightId>()
            .add_systems(Update, track_lights);
        app
    }

    fn ids(app: &mut App) -> Vec<u32> {
        let world = app.world_mut();
        let mut ids: Vec<u32> = world.query::<&RealLight>().iter(world).map(|light| light.id).collect();
        ids.sort_unstable();
        ids
    }

    #[test]
    fn each_light_has_one_event_when_it_appears_and_one_before_it_is_despawned() {
        #[derive(Resource, Default)]
        struct Log(Vec<(u32, bool, bool)>);
        #[derive(Resource, Default)]
        struct Messaged(Vec<u32>);
        fn read(mut appeared: MessageReader<RealLightAppeared>, mut messaged: ResMut<Messaged>) {
            messaged.0.extend(appeared.read().map(|message| message.id));
        }
        let mut app = app();
        app.add_systems(Update, read.after(track_lights))
            .init_resource::<Messaged>()
            .init_resource::<Log>()
            .add_observer(|event: On<RealLightAppeared>, mut log: ResMut<Log>, lights: Query<&RealLight>| {
                log.0.push((event.id, true, lights.get(event.entity).is_ok_and(|light| light.id == event.id)));
            })
            .add_observer(|event: On<RealLightVanished>, mut log: ResMut<Log>, lights: Query<&RealLight>| {
                log.0.push((event.id, false, lights.get(event.entity).is_ok_and(|light| light.id == event.id)));
            });
        for sequence in 1..4 {
            see(&mut app, sequence, vec![lamp(0.0, 0.5)]);
        }
        for sequence in 4..20 {
            see(&mut app, sequence, vec![]);
        }
        assert_eq!(app.world().resource::<Log>().0, [(1, true, true), (1, false, true)]);
        assert_eq!(app.world().resource::<Messaged>().0, [1], "the message beside the event");
    }

    #[test]
    fn lights_keep_their_numbers_while_they_pass_each_other() {
        let mut app = app();
        for step in 0..40 {
            let across = 0.1 * step as f32;
            see(&mut app, 1 + step, vec![lamp(across, 0.5), lamp(4.0 - across + 0.03, 0.05)]);
            assert_eq!(ids(&mut app), [1, 2], "frame {step}");
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
        for sequence in 4..4 + u64::from(MAX_MISSED_FRAMES) {
            see(&mut app, sequence, vec![]);
            assert_eq!(ids(&mut app), [1]);
        }
        see(&mut app, 20, vec![]);
        assert!(ids(&mut app).is_empty());
        see(&mut app, 21, vec![lamp(0.0, 0.5)]);
        assert_eq!(ids(&mut app), [2], "numbers are not given twice");
    }
}
