//! Whole songs danced by the systems of the game, in an app without a renderer.

use crate::{
    game::{Choice, DanceGamePlugin, Playback, Player, Screen, Song},
    rules::Grade,
    song::{Difficulty, Simfile},
};
use bevy::{prelude::*, state::app::StatesPlugin, time::TimeUpdateStrategy};
use std::{path::Path, time::Duration};

const STEP: Duration = Duration::from_nanos(1_000_000_000 / 60);
/// Longer than any dance of the shipped song, in frames.
const MAX_FRAMES: usize = 80 * 60;

/// What a player has reached at the end.
#[derive(Debug, PartialEq)]
struct Outcome {
    hits: [u32; Grade::COUNT],
    holds: (u32, u32),
    best_combo: u32,
    score: f64,
    life: f32,
    dropped: usize,
}

fn game(choice: Choice) -> App {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/music");
    let file = Simfile::open(&folder.join("vibe_ace.sm")).expect("the shipped song");
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, StatesPlugin, DanceGamePlugin))
        .insert_resource(TimeUpdateStrategy::ManualDuration(STEP))
        .insert_resource(Song { file, folder })
        .insert_resource(choice)
        .insert_state(Screen::Dance);
    app.finish();
    app
}

/// Dances to the end and returns what each player has reached, and the number of frames.
fn dance(choice: Choice) -> (Vec<Outcome>, usize) {
    let mut app = game(choice);
    let mut frames = 0;
    while *app.world().resource::<State<Screen>>().get() == Screen::Dance {
        app.update();
        frames += 1;
        assert!(frames < MAX_FRAMES, "the dance does not end");
    }
    let world = app.world_mut();
    let mut query = world.query::<&Player>();
    let mut players: Vec<_> = query.iter(world).collect();
    players.sort_by_key(|player| player.number);
    let (song, playback) = (world.resource::<Song>(), world.resource::<Playback>());
    let outcome = |player: &Player| Outcome {
        hits: Grade::ALL.map(|grade| player.tally.hits(grade)),
        holds: player.tally.holds(),
        best_combo: player.tally.best_combo(),
        score: player.tally.score(),
        life: player.tally.life(),
        dropped: player.dropped(song.timing(), playback.now),
    };
    (players.into_iter().map(outcome).collect(), frames)
}

#[test]
fn a_demo_drops_no_arrow_and_two_runs_are_identical() {
    for difficulty in Difficulty::ALL {
        for players in [1, 2] {
            let choice = Choice { difficulty, players, is_demo: true, ..default() };
            let (outcomes, frames) = dance(choice.clone());
            println!("{difficulty:?}, {players}: {frames} frames, {outcomes:?}");
            assert_eq!(outcomes.len(), players);
            for outcome in &outcomes {
                assert_eq!((outcome.hits[Grade::Miss.index()], outcome.holds.1, outcome.dropped), (0, 0, 0));
                assert!(outcome.hits.iter().sum::<u32>() > 90 && outcome.life > 0.9);
            }
            assert!(players == 1 || outcomes[0] != outcomes[1], "two players are not one");
            assert_eq!(dance(choice).0, outcomes);
        }
    }
}

#[test]
fn who_does_not_step_fails_and_drops_nothing() {
    let mut app = game(Choice::default());
    let mut last_life = 1.0;
    while *app.world().resource::<State<Screen>>().get() == Screen::Dance {
        app.update();
        let world = app.world_mut();
        let now = world.resource::<Playback>().now;
        let timing = world.resource::<Song>().timing().clone();
        let mut players = world.query::<&Player>();
        let player = players.single(world).expect("one player");
        assert!(player.tally.life() <= last_life, "life rises without a step");
        assert_eq!(player.dropped(&timing, now), 0, "at {now} s");
        last_life = player.tally.life();
    }
    assert_eq!(last_life, 0.0);
}

#[test]
fn an_easy_dance_goes_on_without_life() {
    let (outcomes, frames) = dance(Choice { difficulty: Difficulty::Easy, ..default() });
    assert_eq!((outcomes[0].life, outcomes[0].score, outcomes[0].dropped), (0.0, 0.0, 0));
    assert!(frames > 58 * 60 && outcomes[0].hits[Grade::Miss.index()] > 90, "{frames} frames, {outcomes:?}");
}

#[test]
fn a_pause_holds_the_song_and_costs_nothing() {
    let choice = Choice { is_demo: true, ..default() };
    let (expected, _) = dance(choice.clone());
    let mut app = game(choice);
    for _ in 0..600 {
        app.update();
    }
    app.world_mut().resource_mut::<Playback>().set_paused(true);
    app.update();
    let held = app.world().resource::<Playback>().now;
    for _ in 0..120 {
        app.update();
    }
    assert_eq!(app.world().resource::<Playback>().now, held);
    app.world_mut().resource_mut::<Playback>().set_paused(false);
    while *app.world().resource::<State<Screen>>().get() == Screen::Dance {
        app.update();
    }
    let world = app.world_mut();
    let player = world.query::<&Player>().single(world).expect("one player");
    assert_eq!(player.tally.score(), expected[0].score);
}
