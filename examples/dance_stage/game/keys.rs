//! Steps with keys.

use super::{calibration::Latency, playback::Playback, player::Steps};
use crate::{
    rules::{Step, StepKind},
    song::Lane,
};
use bevy::prelude::*;

/// Keys of a player for each lane. Any of them will do.
#[derive(Component)]
pub(crate) struct StepKeys(pub [&'static [KeyCode]; Lane::COUNT]);

impl StepKeys {
    /// Keys for one of two players: the left half of the keyboard, or the arrow keys.
    pub(crate) fn of_two(number: usize) -> Self {
        match number {
            0 => Self([&[KeyCode::KeyA], &[KeyCode::KeyS], &[KeyCode::KeyW], &[KeyCode::KeyD]]),
            _ => Self([&[KeyCode::ArrowLeft], &[KeyCode::ArrowDown], &[KeyCode::ArrowUp], &[KeyCode::ArrowRight]]),
        }
    }

    /// Keys for a player who has them all.
    pub(crate) fn alone() -> Self {
        Self([
            &[KeyCode::ArrowLeft, KeyCode::KeyA],
            &[KeyCode::ArrowDown, KeyCode::KeyS],
            &[KeyCode::ArrowUp, KeyCode::KeyW],
            &[KeyCode::ArrowRight, KeyCode::KeyD],
        ])
    }
}

pub(super) fn step_with_keys(
    keys: Option<Res<ButtonInput<KeyCode>>>,
    playback: Res<Playback>,
    latency: Res<Latency>,
    mut players: Query<(&StepKeys, &mut Steps)>,
) {
    let Some(keys) = keys.filter(|_| !playback.is_paused()) else {
        return;
    };
    for (step_keys, mut steps) in &mut players {
        for (lane, lane_keys) in Lane::ALL.into_iter().zip(step_keys.0) {
            let own = || lane_keys.iter().copied();
            let changes = [keys.any_just_pressed(own()), keys.any_just_released(own()), keys.any_pressed(own())];
            push_steps(&mut steps, lane, playback.now - latency.0, changes);
        }
    }
}

/// Adds the steps on a panel that has several keys or buttons: whether any was pressed and any released in this frame,
/// and whether any is down. The panel is free when none is.
pub(super) fn push_steps(steps: &mut Steps, lane: Lane, seconds: f64, [was_pressed, was_released, is_down]: [bool; 3]) {
    let is_free = was_released && !is_down;
    let kinds = [was_pressed.then_some(StepKind::Press), is_free.then_some(StepKind::Release)];
    steps.0.extend(kinds.into_iter().flatten().map(|kind| Step { seconds, lane, kind }));
}
