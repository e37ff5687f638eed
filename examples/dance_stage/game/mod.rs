//! The dance game: players step on arrows in time with a song.
//!
//! A [`Song`] and [`Player`]s with their [`Steps`] enter, verdicts and tallies leave, as components of the players. The
//! systems run in the order of [`GameSystems`]; whatever makes steps (keys, gamepads, a demo, a camera) does so in
//! [`GameSystems::Step`]. Nothing here draws or needs a renderer, so that tests play whole songs in no time.
//!
//! | stage | enters | leaves |
//! |---|---|---|
//! | [`GameSystems::Time`] | [`Time`], position of the audio | [`Playback`] |
//! | [`GameSystems::Step`] | keys, gamepads, fields of a mat, or a plan | [`Steps`] |
//! | [`GameSystems::Judge`] | [`Steps`] | [`Player`] |

mod calibration;
mod controls;
mod demo;
mod fields;
mod gamepads;
mod keys;
mod menu_action;
#[cfg(feature = "audio")]
mod music;
mod playback;
mod player;
mod screen;

pub(crate) use calibration::{Calibration, Latency};
pub(crate) use controls::ControlsPlugin;
pub(crate) use fields::{Shoe, StepField};
pub(crate) use menu_action::MenuAction;
#[cfg(feature = "audio")]
pub(crate) use music::MusicPlugin;
pub(crate) use playback::{Playback, Song};
pub(crate) use player::Player;
pub(crate) use screen::{Choice, Screen};

use bevy::prelude::*;

/// Stages of a frame of the game, in this order.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum GameSystems {
    /// The position of the music is read.
    Listen,
    /// The clock of the song advances.
    Time,
    /// Players step.
    Step,
    /// Their steps are judged.
    Judge,
}

/// Plays the [`Song`] on [`Screen::Dance`]. Without a song it does nothing.
pub(crate) struct DanceGamePlugin;

impl Plugin for DanceGamePlugin {
    fn build(&self, app: &mut App) {
        let dances = in_state(Screen::Dance).and_then(resource_exists::<Playback>);
        let sounds = in_state(Screen::Dance).or_else(in_state(Screen::Calibration));
        app.init_state::<Screen>()
            .init_resource::<Choice>()
            .init_resource::<Latency>()
            .configure_sets(Update, (GameSystems::Time, GameSystems::Step, GameSystems::Judge).chain().run_if(dances))
            .configure_sets(
                Update,
                GameSystems::Listen
                    .before(GameSystems::Time)
                    .before(playback::advance_metronome)
                    .run_if(sounds.and_then(resource_exists::<Playback>)),
            )
            .add_systems(OnEnter(Screen::Dance), (player::despawn_players, screen::start_dance).chain())
            .add_systems(OnEnter(Screen::Calibration), calibration::start_metronome)
            .add_systems(Update, playback::advance_clock.in_set(GameSystems::Time))
            .add_systems(
                Update,
                (playback::advance_metronome, calibration::step_to_metronome)
                    .chain()
                    .run_if(calibration::is_calibrating),
            )
            .add_systems(
                Update,
                (keys::step_with_keys, gamepads::step_with_gamepads, fields::step_on_fields, demo::step_by_plan)
                    .in_set(GameSystems::Step),
            )
            .add_systems(Update, (player::judge_steps, screen::end_dance).chain().in_set(GameSystems::Judge));
    }
}
