//! What the game shows: the title, a dance, its results.

use super::{
    demo::Demo,
    gamepads::StepGamepad,
    keys::StepKeys,
    playback::{Playback, Song},
    player::Player,
};
use crate::{
    rules::{DemoPlayer, TimingWindows},
    song::Difficulty,
};
use bevy::prelude::*;

#[derive(States, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Screen {
    /// What to dance is chosen.
    #[default]
    Title,
    /// The dancer is alone, and nothing is shown over the picture.
    Rehearsal,
    Dance,
    Results,
    /// Players step to a metronome.
    Calibration,
    /// What keys and buttons do.
    Help,
}

/// How the next dance will be.
#[derive(Resource, Clone, Debug)]
pub(crate) struct Choice {
    pub difficulty: Difficulty,
    /// One or two.
    pub players: usize,
    /// Whether the players dance by themselves.
    pub is_demo: bool,
    /// Seed of the demo's inaccuracies.
    pub seed: u64,
    /// Time before the first arrow is due, in seconds.
    pub lead_in: f64,
    /// Whether the song is played from its beginning, unless its first arrow is due earlier than that.
    pub plays_intro: bool,
    pub windows: TimingWindows,
}

impl Default for Choice {
    fn default() -> Self {
        let windows = TimingWindows::scaled(1.0);
        Self {
            difficulty: Difficulty::Medium,
            players: 1,
            is_demo: false,
            seed: 1,
            lead_in: 3.0,
            plays_intro: true,
            windows,
        }
    }
}

/// Time from the end of the last arrow to the results, in seconds.
const APPLAUSE: f64 = 2.0;

/// Puts the players on the stage, and the song to its beginning.
pub(super) fn start_dance(mut commands: Commands, song: Option<Res<Song>>, choice: Res<Choice>) {
    let Some((song, chart)) = song.as_ref().and_then(|song| Some((song, song.file.chart(choice.difficulty)?))) else {
        return;
    };
    let timing = song.timing();
    let first = chart.notes().first().map_or(0.0, |note| timing.seconds_at(note.beat()));
    let start = first - choice.lead_in;
    let start = if choice.plays_intro { start.min(0.0) } else { start };
    commands.insert_resource(Playback::starting_at(start, timing));
    for number in 0..choice.players {
        let mut player = commands.spawn(Player::new(number, chart.clone(), timing, choice.windows));
        if choice.is_demo {
            let seed = choice.seed.wrapping_add(number as u64);
            player.insert(Demo(DemoPlayer::new(chart, timing, choice.windows, DemoPlayer::GOOD_SPREAD_SECONDS, seed)));
        } else {
            player.insert(match choice.players {
                1 => (StepKeys::alone(), StepGamepad::Any),
                _ => (StepKeys::of_two(number), StepGamepad::Nth(number)),
            });
        }
    }
}

/// Shows the results when all players have danced to the end, or none of them has any life left. Easy dances go on
/// without: who learns the steps shall see them all.
pub(super) fn end_dance(
    playback: Res<Playback>,
    song: Res<Song>,
    players: Query<&Player>,
    mut next: ResMut<NextState<Screen>>,
) {
    let end = |player: &Player| {
        let last = player.chart.last_row().map_or(0.0, |row| song.timing().seconds_at(row.beat()));
        player.judge.is_finished() && playback.now > last + APPLAUSE
    };
    let is_over = |player: &Player| player.tally.has_failed() && player.chart.difficulty != Difficulty::Easy;
    if players.iter().all(|player| is_over(player) || end(player)) {
        next.set(Screen::Results);
    }
}
