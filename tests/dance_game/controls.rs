//! Menus and steps with keys and gamepads, in an app without a window.

use crate::{
    game::{Choice, ControlsPlugin, DanceGamePlugin, MenuAction, Playback, Player, Screen, Song},
    song::{Difficulty, Simfile},
};
use bevy::{
    input::{
        InputPlugin,
        gamepad::{GamepadConnection, GamepadConnectionEvent, RawGamepadButtonChangedEvent, RawGamepadEvent},
    },
    prelude::*,
    state::app::StatesPlugin,
    time::TimeUpdateStrategy,
};
use std::{path::Path, time::Duration};

/// The game on its title, with so many gamepads.
struct Game {
    app: App,
    gamepads: Vec<Entity>,
}

impl Game {
    fn new(gamepads: usize) -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/music");
        let file = Simfile::open(&folder.join("vibe_ace.sm")).expect("the shipped song");
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, InputPlugin, StatesPlugin, DanceGamePlugin, ControlsPlugin))
            .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(10)))
            .insert_resource(Song { file, folder });
        app.finish();
        let gamepads: Vec<_> = (0..gamepads).map(|_| app.world_mut().spawn_empty().id()).collect();
        for gamepad in &gamepads {
            let connection =
                GamepadConnection::Connected { name: "a dance mat".to_owned(), vendor_id: None, product_id: None };
            app.world_mut().write_message(GamepadConnectionEvent { gamepad: *gamepad, connection });
        }
        app.update();
        Self { app, gamepads }
    }

    fn set(&mut self, gamepad: usize, button: GamepadButton, value: f32) {
        let event = RawGamepadButtonChangedEvent { gamepad: self.gamepads[gamepad], button, value };
        self.app.world_mut().write_message(RawGamepadEvent::Button(event));
        self.app.update();
        // What was pressed shows in the next frame, as a state does.
        self.app.update();
    }

    fn press(&mut self, gamepad: usize, button: GamepadButton) {
        self.set(gamepad, button, 1.0);
        self.set(gamepad, button, 0.0);
    }

    fn type_key(&mut self, key: KeyCode) {
        self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().press(key);
        self.app.world_mut().run_schedule(Update);
        self.app.world_mut().resource_mut::<ButtonInput<KeyCode>>().reset(key);
        self.app.update();
    }

    fn choose(&mut self, action: MenuAction) {
        self.app.world_mut().write_message(action);
        self.app.update();
        self.app.update();
    }

    fn screen(&self) -> Screen {
        *self.app.world().resource::<State<Screen>>().get()
    }

    fn choice(&self) -> &Choice {
        self.app.world().resource()
    }

    /// Panels on which each player stands, the first player first.
    fn stands(&mut self) -> Vec<[bool; 4]> {
        let world = self.app.world_mut();
        let mut players: Vec<_> = world.query::<&Player>().iter(world).collect();
        players.sort_by_key(|player| player.number);
        players.into_iter().map(|player| player.stands_on).collect()
    }
}

#[test]
fn a_gamepad_goes_through_all_screens() {
    let mut game = Game::new(1);
    assert_eq!(game.screen(), Screen::Title);
    let before = game.choice().clone();
    game.press(0, GamepadButton::DPadRight);
    assert_ne!(game.choice().difficulty, before.difficulty);
    game.press(0, GamepadButton::DPadLeft);
    assert_eq!(game.choice().difficulty, before.difficulty);
    game.press(0, GamepadButton::DPadUp);
    assert_eq!(game.choice().players, 2);
    game.press(0, GamepadButton::North);
    assert!(game.choice().is_demo);
    game.press(0, GamepadButton::Select);
    assert_eq!(game.screen(), Screen::Help);
    game.press(0, GamepadButton::East);
    game.press(0, GamepadButton::West);
    assert_eq!(game.screen(), Screen::Calibration);
    game.press(0, GamepadButton::South);
    assert_eq!(game.screen(), Screen::Calibration, "South is a step there");
    game.press(0, GamepadButton::Select);
    game.press(0, GamepadButton::Start);
    assert_eq!(game.screen(), Screen::Dance);
    game.press(0, GamepadButton::Start);
    assert!(game.app.world().resource::<Playback>().is_paused());
    game.press(0, GamepadButton::Select);
    assert_eq!(game.screen(), Screen::Title);
}

#[test]
fn keys_go_through_all_screens_and_out() {
    let mut game = Game::new(0);
    game.type_key(KeyCode::ArrowDown);
    assert_eq!(game.choice().players, 2);
    game.type_key(KeyCode::KeyH);
    assert_eq!(game.screen(), Screen::Help);
    game.type_key(KeyCode::Escape);
    game.type_key(KeyCode::Enter);
    assert_eq!(game.screen(), Screen::Dance);
    game.type_key(KeyCode::ArrowDown);
    assert_eq!(game.choice().players, 2, "arrows are steps there");
    game.type_key(KeyCode::Escape);
    assert_eq!((game.screen(), game.app.should_exit()), (Screen::Title, None));
    game.type_key(KeyCode::Escape);
    assert_eq!(game.app.should_exit(), Some(AppExit::Success));
}

#[test]
fn what_makes_no_sense_on_a_screen_does_nothing() {
    let mut game = Game::new(0);
    game.choose(MenuAction::Pause);
    game.choose(MenuAction::Start);
    let difficulty = game.choice().difficulty;
    for action in [MenuAction::Harder, MenuAction::SwitchPlayers, MenuAction::SetTiming, MenuAction::Start] {
        game.choose(action);
    }
    assert_eq!((game.screen(), game.choice().difficulty, game.choice().players), (Screen::Dance, difficulty, 1));
    // Around and back again.
    game.choose(MenuAction::Back);
    for _ in Difficulty::ALL {
        game.choose(MenuAction::Harder);
    }
    assert_eq!(game.choice().difficulty, difficulty);
}

#[test]
fn each_of_two_players_steps_with_a_gamepad_of_their_own() {
    let mut game = Game::new(2);
    game.choose(MenuAction::SwitchPlayers);
    game.choose(MenuAction::Start);
    game.set(0, GamepadButton::DPadLeft, 1.0);
    game.set(1, GamepadButton::North, 1.0);
    assert_eq!(game.stands(), [[true, false, false, false], [false, false, true, false]]);
    // The other button of the lane is still down.
    game.set(1, GamepadButton::DPadUp, 1.0);
    game.set(1, GamepadButton::North, 0.0);
    assert!(game.stands()[1][2]);
    game.set(1, GamepadButton::DPadUp, 0.0);
    assert_eq!(game.stands(), [[true, false, false, false], [false; 4]]);
}

#[test]
fn a_single_player_steps_with_any_gamepad_but_not_in_a_pause() {
    let mut game = Game::new(2);
    game.choose(MenuAction::Start);
    game.set(1, GamepadButton::East, 1.0);
    assert_eq!(game.stands(), [[false, false, false, true]]);
    game.choose(MenuAction::Pause);
    game.set(0, GamepadButton::DPadLeft, 1.0);
    assert_eq!(game.stands(), [[false, false, false, true]]);
}
