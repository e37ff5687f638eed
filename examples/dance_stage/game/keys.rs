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
            let was_pressed = keys.any_just_pressed(lane_keys.iter().copied());
            let was_released = keys.any_just_released(lane_keys.iter().copied());
            // A panel is free when no key of its lane is down.
            let is_free = was_released && !keys.any_pressed(lane_keys.iter().copied());
            let kinds = [was_pressed.then_some(StepKind::Press), is_free.then_some(StepKind::Release)];
            for kind in kinds.into_iter().flatten() {
                steps.0.push(Step { seconds: playback.now - latency.0, lane, kind });
            }
        }
    }
}
