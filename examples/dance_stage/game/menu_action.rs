//! What players want beside their steps, whatever they say it with: keys, a gamepad or the mouse.

use super::{
    playback::Playback,
    screen::{Choice, Screen},
};
use crate::song::Difficulty;
use bevy::prelude::*;

/// One wish. Those that make no sense on the present [`Screen`] are ignored.
#[derive(Message, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MenuAction {
    Easier,
    Harder,
    /// One player instead of two, or two instead of one.
    SwitchPlayers,
    SwitchDemo,
    Start,
    SetTiming,
    ShowHelp,
    Pause,
    /// To the title, and from there out of the game.
    Back,
    SwitchFullScreen,
    SwitchPanel,
}

pub(super) fn act(
    mut actions: MessageReader<MenuAction>,
    screen: Res<State<Screen>>,
    mut next: ResMut<NextState<Screen>>,
    mut choice: ResMut<Choice>,
    playback: Option<ResMut<Playback>>,
    mut exit: MessageWriter<AppExit>,
) {
    let mut playback = playback;
    for action in actions.read() {
        match (screen.get(), action) {
            (Screen::Title, MenuAction::Easier) => choice.difficulty = neighbor(choice.difficulty, -1),
            (Screen::Title, MenuAction::Harder) => choice.difficulty = neighbor(choice.difficulty, 1),
            (Screen::Title, MenuAction::SwitchPlayers) => choice.players = 3 - choice.players,
            (Screen::Title, MenuAction::SwitchDemo) => choice.is_demo = !choice.is_demo,
            (Screen::Title, MenuAction::Start) => next.set(Screen::Dance),
            (Screen::Title, MenuAction::SetTiming) => next.set(Screen::Calibration),
            (Screen::Title, MenuAction::ShowHelp) => next.set(Screen::Help),
            (Screen::Title, MenuAction::Back) => {
                exit.write(AppExit::Success);
            }
            (Screen::Dance, MenuAction::Pause) => {
                if let Some(playback) = &mut playback {
                    let is_paused = playback.is_paused();
                    playback.set_paused(!is_paused);
                }
            }
            (Screen::Dance, MenuAction::Back)
            | (Screen::Results | Screen::Calibration | Screen::Help, MenuAction::Back | MenuAction::Start) => {
                next.set(Screen::Title);
            }
            _ => {}
        }
    }
}

fn neighbor(difficulty: Difficulty, step: i32) -> Difficulty {
    let wanted = (difficulty as i32 + step).rem_euclid(Difficulty::ALL.len() as i32);
    Difficulty::ALL[wanted as usize]
}
