//! Steps on a printed mat, which the camera sees: with fingers or feet that cover its fields, or with markers on shoes.
//!
//! A step counts when the camera has seen it, not when its frame arrives.

use super::{calibration::Latency, demo::Demo, playback::Playback, player::Steps};
use crate::{
    rules::{Step, StepKind},
    song::Lane,
};
use bevy::{
    ecs::{entity::EntityHashSet, system::SystemParam},
    prelude::*,
};
use bevy_mirrorball::prelude::*;
use std::time::Duration;

/// How far above the ground a shoe may be that stands on it, in meters, and by how much more until it has left it.
const STANDING: f32 = 0.015;
const LIFTED: f32 = 0.03;
/// How far a shoe has to leave a field, in meters.
const BESIDE: f32 = 0.01;
/// Longest age of a frame that is believed.
const MAX_AGE: Duration = Duration::from_millis(500);

/// A field of the mat, on the entity of its [`VirtualButton`].
#[derive(Component)]
#[require(VirtualButton)]
pub(crate) struct StepField {
    lane: Lane,
    is_down: bool,
}

impl StepField {
    pub(crate) fn new(lane: Lane) -> Self {
        Self { lane, is_down: false }
    }
}

/// Marker on a shoe, on the entity of its [`MarkerAnchor`]. While shoes are seen, what covers the fields does not
/// matter: feet above them cover them, too.
#[derive(Component, Default)]
pub(crate) struct Shoe {
    /// Lowest height above the mat at which the marker was seen, in meters: that of a shoe on the ground.
    lowest: Option<f32>,
}

impl Shoe {
    /// Whether the shoe stands on a field, seen from whose middle its marker is here.
    fn stands_on(&mut self, field: &StepField, button: &VirtualButton, here: Vec3) -> bool {
        let lowest = self.lowest.map_or(here.y, |lowest| lowest.min(here.y));
        self.lowest = Some(lowest);
        let (beside, height) = if field.is_down { (BESIDE, LIFTED) } else { (0.0, STANDING) };
        here.xz().abs().cmple(0.5 * button.size + beside).all() && here.y <= lowest + height
    }
}

/// Seconds since the camera has seen something.
fn age(time: &Time<Real>, at: Option<Duration>) -> f64 {
    let age = at.map_or(Duration::ZERO, |at| time.elapsed().saturating_sub(at));
    if age > MAX_AGE { 0.0 } else { age.as_secs_f64() }
}

/// Ages in seconds of the presses of fields that the newest frames show.
#[derive(SystemParam)]
pub(super) struct NewPresses<'w, 's> {
    time: Res<'w, Time<Real>>,
    fields: Query<'w, 's, (Entity, &'static VirtualButtonState), (With<StepField>, Changed<VirtualButtonState>)>,
    down: Local<'s, EntityHashSet>,
}

impl NewPresses<'_, '_> {
    pub(super) fn take(&mut self) -> Vec<f64> {
        let mut ages = Vec::new();
        for (field, state) in &self.fields {
            if !state.is_pressed() {
                self.down.remove(&field);
            } else if self.down.insert(field) {
                ages.push(age(&self.time, state.changed_at));
            }
        }
        ages
    }
}

/// Lets all players step that do not dance by themselves.
pub(super) fn step_on_fields(
    time: Res<Time<Real>>,
    playback: Res<Playback>,
    latency: Res<Latency>,
    mut fields: Query<(Entity, &mut StepField, &VirtualButton, &VirtualButtonState)>,
    mut shoes: Query<(Entity, &mut Shoe, &MarkerTracking)>,
    places: TransformHelper,
    mut players: Query<&mut Steps, Without<Demo>>,
) {
    let mut new = Vec::new();
    // Markers have moved in this frame; global transforms follow at its end.
    let place = |entity| places.compute_global_transform(entity).ok();
    let mut seen: Vec<_> = shoes.iter_mut().filter(|(.., tracking)| tracking.state.is_found()).collect();
    for (entity, mut field, button, state) in &mut fields {
        let Some(field_from_world) = place(entity).map(|place| place.to_isometry().inverse()) else { continue };
        let (mut is_down, mut at) = (state.is_pressed(), state.changed_at);
        if !seen.is_empty() {
            (is_down, at) = (false, None);
            for (entity, shoe, tracking) in &mut seen {
                let Some(place) = place(*entity) else { continue };
                let here = Vec3::from(field_from_world.transform_point(place.translation()));
                is_down |= shoe.stands_on(&field, button, here);
                at = at.max(tracking.last_seen_at);
            }
        }
        if is_down != field.is_down {
            field.is_down = is_down;
            let kind = if is_down { StepKind::Press } else { StepKind::Release };
            new.push(Step { seconds: playback.now - age(&time, at) - latency.0, lane: field.lane, kind });
        }
    }
    if playback.is_paused() {
        return;
    }
    new.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    for mut steps in &mut players {
        steps.0.extend_from_slice(&new);
    }
}
