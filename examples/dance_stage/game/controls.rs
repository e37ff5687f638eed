//! Keys of the menus and of the pause.

use super::{
    playback::Playback,
    screen::{Choice, Screen},
};
use crate::song::Difficulty;
use bevy::prelude::*;

/// Lets keys choose, start, pause and leave a dance.
pub(crate) struct ControlsPlugin;

impl Plugin for ControlsPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(
            Update,
            (
                choose.run_if(in_state(Screen::Title)),
                pause_or_leave.run_if(in_state(Screen::Dance)),
                return_to_title.run_if(in_state(Screen::Results).or_else(in_state(Screen::Calibration))),
            ),
        );
    }
}

fn choose(
    keys: Res<ButtonInput<KeyCode>>,
    mut choice: ResMut<Choice>,
    mut next: ResMut<NextState<Screen>>,
    mut exit: MessageWriter<AppExit>,
) {
    let steps = i32::from(keys.just_pressed(KeyCode::ArrowRight)) - i32::from(keys.just_pressed(KeyCode::ArrowLeft));
    if steps != 0 {
        let wanted = (choice.difficulty as i32 + steps).rem_euclid(Difficulty::ALL.len() as i32);
        choice.difficulty = Difficulty::ALL[wanted as usize];
    }
    if keys.any_just_pressed([KeyCode::ArrowUp, KeyCode::ArrowDown]) {
        choice.players = 3 - choice.players;
    }
    if keys.just_pressed(KeyCode::KeyD) {
        choice.is_demo = !choice.is_demo;
    }
    if keys.any_just_pressed([KeyCode::Enter, KeyCode::NumpadEnter]) {
        next.set(Screen::Dance);
    }
    if keys.just_pressed(KeyCode::KeyC) {
        next.set(Screen::Calibration);
    }
    if keys.just_pressed(KeyCode::Escape) {
        exit.write(AppExit::Success);
    }
}

fn pause_or_leave(
    keys: Res<ButtonInput<KeyCode>>,
    playback: Option<ResMut<Playback>>,
    mut next: ResMut<NextState<Screen>>,
) {
    if keys.just_pressed(KeyCode::Escape) {
        next.set(Screen::Title);
    }
    if let Some(mut playback) = playback
        && keys.just_pressed(KeyCode::Space)
    {
        let is_paused = playback.is_paused();
        playback.set_paused(!is_paused);
    }
}

fn return_to_title(keys: Res<ButtonInput<KeyCode>>, mut next: ResMut<NextState<Screen>>) {
    if keys.any_just_pressed([KeyCode::Enter, KeyCode::NumpadEnter, KeyCode::Escape]) {
        next.set(Screen::Title);
    }
}
