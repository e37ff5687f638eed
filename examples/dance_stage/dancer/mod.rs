//! The dancer: a skinned glTF figure that performs the step of every arrow on its beat.

mod animations;
mod choreography;
mod figure;
mod rest_pose;
mod routine;

pub(crate) use figure::Dancer;

use crate::{
    game::{GameSystems, Playback, Player, Screen, Song},
    stage::{self, THINGS},
    support::Outcome,
};
use bevy::prelude::*;
use choreography::{Move, applause, motions};
use figure::Figure;
use routine::Routine;
use std::path::{Path, PathBuf};

/// Animates the [`Dancer`]s: to the song while it plays, else to a routine of their own.
pub(crate) struct DancerPlugin;

impl Plugin for DancerPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Dance>()
            .init_resource::<Routine>()
            .add_systems(Update, (keep_the_beat, figure::prepare, dance).chain().after(GameSystems::Judge));
    }
}

/// The glTF file of the dancer.
#[derive(Resource)]
pub(crate) struct DancerFile(pub PathBuf);

/// Checks that a file can be read, and says which moves it lacks.
pub(crate) fn check_file(path: &Path) -> Outcome<()> {
    let file = gltf::Gltf::open(path)
        .map_err(|error| format!("cannot read the dancer {}: {error}; --dancer takes a glTF file", path.display()))?;
    let names: Vec<_> = file.animations().filter_map(|animation| animation.name()).collect();
    let lacks = |what: &Move| animations::of_move(*what, &names).is_none();
    let lacking: Vec<_> = Move::ALL.into_iter().filter(lacks).map(Move::name).collect();
    if !lacking.is_empty() {
        println!("dance_stage: {} has no animation {}; the dancer leaves it out", path.display(), lacking.join(", "));
    }
    Ok(())
}

/// Spawns the dancer on the stage.
pub(crate) fn spawn(mut commands: Commands, assets: Res<AssetServer>, file: Res<DancerFile>) {
    stage::thing(&mut commands, THINGS[0], Vec3::Y * stage::FLOOR).insert(Dancer(assets.load(file.0.clone())));
}

/// Progress of the dance while no song plays.
#[derive(Resource, Default)]
pub(crate) struct Dance {
    pub beats: f32,
    pub is_held: bool,
}

const BEATS_PER_SECOND: f32 = 2.0;

fn keep_the_beat(mut dance: ResMut<Dance>, time: Res<Time>) {
    if !dance.is_held {
        dance.beats += time.delta_secs() * BEATS_PER_SECOND;
    }
}

fn dance(
    dance: Res<Dance>,
    routine: Res<Routine>,
    screen: Res<State<Screen>>,
    song: Option<Res<Song>>,
    playback: Option<Res<Playback>>,
    players: Query<&Player>,
    mut figures: Query<Figure>,
) {
    // Two players dance the same chart.
    let first = players.iter().min_by_key(|player| player.number);
    let beat = f64::from(dance.beats);
    let (motions, beat) = match (screen.get(), song, playback, first) {
        (Screen::Dance, Some(song), Some(playback), Some(player)) => {
            let stumbled = player.last_miss.map(|seconds| song.timing().beat_at(seconds));
            (motions(&player.chart, playback.beat, stumbled), playback.beat)
        }
        (Screen::Results, ..) => (applause(beat), beat),
        _ => (routine.motions(beat), beat),
    };
    for mut figure in &mut figures {
        figure.show(&motions, beat);
    }
}
