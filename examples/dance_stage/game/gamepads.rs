//! Steps with gamepads and dance mats. Mats call themselves gamepads, and their arrows are those of the D-pad.

use super::{calibration::Latency, keys::push_steps, playback::Playback, player::Steps};
use crate::song::Lane;
use bevy::prelude::*;

/// Lets a player step with the arrows of a gamepad, or with the buttons that lie like them.
#[derive(Component)]
pub(crate) enum StepGamepad {
    /// Any of them.
    Any,
    /// The first, second and so on that was connected.
    Nth(usize),
}

fn buttons(lane: Lane) -> [GamepadButton; 2] {
    match lane {
        Lane::Left => [GamepadButton::DPadLeft, GamepadButton::West],
        Lane::Down => [GamepadButton::DPadDown, GamepadButton::South],
        Lane::Up => [GamepadButton::DPadUp, GamepadButton::North],
        Lane::Right => [GamepadButton::DPadRight, GamepadButton::East],
    }
}

/// Whether any button for a step was pressed on a gamepad.
pub(super) fn was_any_pressed(gamepad: &Gamepad) -> bool {
    Lane::ALL.into_iter().any(|lane| gamepad.any_just_pressed(buttons(lane)))
}

pub(super) fn step_with_gamepads(
    gamepads: Query<(Entity, &Gamepad)>,
    mut connected: Local<Vec<Entity>>,
    playback: Res<Playback>,
    latency: Res<Latency>,
    mut players: Query<(&StepGamepad, &mut Steps)>,
) {
    connected.retain(|gamepad| gamepads.contains(*gamepad));
    for (gamepad, _) in &gamepads {
        if !connected.contains(&gamepad) {
            connected.push(gamepad);
        }
    }
    if playback.is_paused() {
        return;
    }
    let seconds = playback.now - latency.0;
    for (which, mut steps) in &mut players {
        let own = match which {
            StepGamepad::Any => &connected[..],
            StepGamepad::Nth(n) => connected.get(*n).map_or(&[][..], std::slice::from_ref),
        };
        for (_, gamepad) in gamepads.iter_many(own) {
            for lane in Lane::ALL {
                let own = buttons(lane);
                let changes = [gamepad.any_just_pressed(own), gamepad.any_just_released(own), gamepad.any_pressed(own)];
                push_steps(&mut steps, lane, seconds, changes);
            }
        }
    }
}
