//! What the game remembers until the next time, in a file where the system keeps settings of programs.

use crate::{
    game::{Choice, Latency},
    song::Difficulty,
};
use bevy::{
    prelude::*,
    settings::{ReflectSettingsGroup, SaveSettingsDeferred, SaveSettingsSync, SettingsGroup, SettingsPlugin},
};

/// Name of the folder of the file.
const PROGRAM: &str = "bevy_mirrorball.dance_stage";
/// Longest latency that is believed, in seconds.
const MAX_LATENCY: f64 = 1.0;

/// The settings as they are in the file. What makes no sense there counts as not set.
#[derive(Resource, SettingsGroup, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Resource, SettingsGroup, Default)]
#[settings_group(group = "dance")]
pub(crate) struct Remembered {
    difficulty: String,
    players: u32,
    latency_seconds: f64,
}

impl Remembered {
    /// The next dance as it was chosen the last time.
    pub(crate) fn choice(&self) -> Choice {
        let usual = Choice::default();
        let difficulty = Difficulty::ALL.into_iter().find(|difficulty| difficulty.name() == self.difficulty);
        let players = if self.players == 2 { 2 } else { usual.players };
        Choice { difficulty: difficulty.unwrap_or(usual.difficulty), players, ..usual }
    }

    pub(crate) fn latency(&self) -> Latency {
        Latency(if self.latency_seconds.abs() <= MAX_LATENCY { self.latency_seconds } else { 0.0 })
    }

    fn of(choice: &Choice, latency: Latency) -> Self {
        Self {
            difficulty: choice.difficulty.name().to_owned(),
            players: choice.players as u32,
            latency_seconds: latency.0,
        }
    }
}

/// Reads the settings as soon as it is added, and writes them when they change.
pub(crate) struct RememberPlugin;

impl Plugin for RememberPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<Remembered>()
            .init_resource::<Remembered>()
            .add_plugins(SettingsPlugin::new(PROGRAM))
            .add_systems(Update, remember)
            .add_systems(Last, save_at_the_end);
    }
}

fn remember(mut commands: Commands, choice: Res<Choice>, latency: Res<Latency>, mut remembered: ResMut<Remembered>) {
    if (choice.is_changed() || latency.is_changed()) && remembered.set_if_neq(Remembered::of(&choice, *latency)) {
        commands.queue(SaveSettingsDeferred::default());
    }
}

fn save_at_the_end(mut commands: Commands, mut exits: MessageReader<AppExit>) {
    if exits.read().next().is_some() {
        commands.queue(SaveSettingsSync::IfChanged);
    }
}
