//! Keys and buttons of the menus and of the pause.

use super::{
    menu_action::{MenuAction, act},
    screen::Screen,
};
use bevy::prelude::*;

/// Lets keys and gamepads choose, start, pause and leave a dance.
pub(crate) struct ControlsPlugin;

impl Plugin for ControlsPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<MenuAction>()
            .add_systems(Update, ((press_keys, press_buttons), act).chain().before(super::GameSystems::Listen));
    }
}

fn press_keys(
    keys: Option<Res<ButtonInput<KeyCode>>>,
    screen: Res<State<Screen>>,
    mut actions: MessageWriter<MenuAction>,
) {
    for key in keys.iter().flat_map(|keys| keys.get_just_pressed()) {
        let action = match (screen.get(), key) {
            (_, KeyCode::Escape) => MenuAction::Back,
            (_, KeyCode::F11) => MenuAction::SwitchFullScreen,
            (_, KeyCode::Tab | KeyCode::F1) => MenuAction::SwitchPanel,
            (Screen::Dance, KeyCode::Space) => MenuAction::Pause,
            (Screen::Dance, _) => continue,
            (_, KeyCode::Enter | KeyCode::NumpadEnter) => MenuAction::Start,
            (Screen::Title, KeyCode::ArrowLeft) => MenuAction::Easier,
            (Screen::Title, KeyCode::ArrowRight) => MenuAction::Harder,
            (Screen::Title, KeyCode::ArrowUp | KeyCode::ArrowDown) => MenuAction::SwitchPlayers,
            (Screen::Title, KeyCode::KeyD) => MenuAction::SwitchDemo,
            (Screen::Title, KeyCode::KeyC) => MenuAction::SetTiming,
            (Screen::Title, KeyCode::KeyH) => MenuAction::ShowHelp,
            _ => continue,
        };
        actions.write(action);
    }
}

fn press_buttons(gamepads: Query<&Gamepad>, screen: Res<State<Screen>>, mut actions: MessageWriter<MenuAction>) {
    for button in gamepads.iter().flat_map(Gamepad::get_just_pressed) {
        let action = match (screen.get(), button) {
            (Screen::Dance, GamepadButton::Start) => MenuAction::Pause,
            (Screen::Dance | Screen::Calibration, GamepadButton::Select) => MenuAction::Back,
            // There, all others are steps.
            (Screen::Dance | Screen::Calibration, _) => continue,
            (Screen::Results | Screen::Help, GamepadButton::East | GamepadButton::Select) => MenuAction::Back,
            (_, GamepadButton::South | GamepadButton::Start) => MenuAction::Start,
            (Screen::Title, GamepadButton::DPadLeft) => MenuAction::Easier,
            (Screen::Title, GamepadButton::DPadRight) => MenuAction::Harder,
            (Screen::Title, GamepadButton::DPadUp | GamepadButton::DPadDown) => MenuAction::SwitchPlayers,
            (Screen::Title, GamepadButton::North) => MenuAction::SwitchDemo,
            (Screen::Title, GamepadButton::West) => MenuAction::SetTiming,
            (Screen::Title, GamepadButton::Select) => MenuAction::ShowHelp,
            _ => continue,
        };
        actions.write(action);
    }
}
