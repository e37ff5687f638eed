//! The sound of the song, and where it is.
//!
//! A computer without sound plays the same game, silently: the wall clock alone drives the song.

use super::{
    playback::{Playback, Song},
    screen::Screen,
};
use bevy::{
    audio::{AudioPlayer, AudioSink, AudioSinkPlayback, AudioSource, PlaybackSettings},
    prelude::*,
};

/// Plays the music of a [`Song`] whose file names any.
pub(crate) struct MusicPlugin;

impl Plugin for MusicPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(OnEnter(Screen::Dance), load_music)
            .add_systems(Update, (start_or_pause, hear).chain().in_set(super::GameSystems::Listen));
    }
}

/// The music of the dance.
#[derive(Component)]
struct Music;

fn load_music(mut commands: Commands, assets: Res<AssetServer>, song: Option<Res<Song>>) {
    if let Some(file) = song.and_then(|song| song.music()).filter(|file| file.exists()) {
        let source = assets.load::<AudioSource>(file);
        commands.spawn((Music, AudioPlayer(source), PlaybackSettings::ONCE.paused(), DespawnOnExit(Screen::Dance)));
    }
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
