//! The sound of the song, and where it is.
//!
//! A computer without sound plays the same game, silently: the wall clock alone drives the song.

use super::{
    GameSystems,
    calibration::METRONOME_BPM,
    playback::{Playback, Song},
    screen::Screen,
};
use crate::rules::click_track;
use bevy::{
    audio::{AudioPlayer, AudioSink, AudioSinkPlayback, AudioSource, PlaybackSettings},
    prelude::*,
};

/// Plays the music of a [`Song`] whose file names any, and the clicks of the calibration.
pub(crate) struct MusicPlugin;

impl Plugin for MusicPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(OnEnter(Screen::Dance), load_music)
            .add_systems(OnEnter(Screen::Calibration), load_clicks)
            .add_systems(Update, (start_or_pause, hear).chain().in_set(GameSystems::Listen));
    }
}

/// Length of the sound of the metronome: several rounds of steps.
const CLICK_SECONDS: f64 = 180.0;

/// The music of the dance, or the clicks.
#[derive(Component)]
struct Music;

fn load_music(mut commands: Commands, assets: Res<AssetServer>, song: Option<Res<Song>>) {
    if let Some(file) = song.and_then(|song| song.music()).filter(|file| file.exists()) {
        let source = assets.load::<AudioSource>(file);
        commands.spawn((Music, AudioPlayer(source), PlaybackSettings::ONCE.paused(), DespawnOnExit(Screen::Dance)));
    }
}

fn load_clicks(mut commands: Commands, mut sources: ResMut<Assets<AudioSource>>) {
    let bytes = click_track(60.0 / METRONOME_BPM, CLICK_SECONDS).into();
    let source = sources.add(AudioSource { bytes });
    commands.spawn((Music, AudioPlayer(source), PlaybackSettings::ONCE.paused(), DespawnOnExit(Screen::Calibration)));
}

/// Starts the music when the song begins, and holds it while the song is paused.
fn start_or_pause(playback: Res<Playback>, music: Query<&AudioSink, With<Music>>) {
    for sink in &music {
        if playback.is_paused() || playback.now < 0.0 {
            sink.pause();
        } else {
            sink.play();
        }
    }
}

/// Tells the clock of the song what is heard.
fn hear(mut playback: ResMut<Playback>, music: Query<&AudioSink, With<Music>>) {
    let playing = music.iter().find(|sink| !sink.is_paused() && !sink.empty());
    playback.heard = playing.map(|sink| sink.position().as_secs_f64());
}
