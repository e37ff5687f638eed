//! What a desktop has and a browser's page has not: a command line, files, displays, pictures without a window.

use crate::{
    Outcome, composer, dancer,
    game::Song,
    headless,
    options::{DEVICE_SIZE, Feed, Options, SongFile},
    song::Simfile,
    support::{has_display, run_with_options},
    usage::USAGE,
    window,
};
use bevy::{asset::UnapprovedPathMode, prelude::*};
use bevy_mirrorball::{camera::Clip, prelude::*};
use std::{path::Path, process::ExitCode};

pub(crate) use dancer::check_file as check_dancer;

/// Runs the stage with the options of the command line.
pub(crate) fn main() -> ExitCode {
    run_with_options("dance_stage", USAGE, Options::parse(lexopt::Parser::from_env()), run)
}

fn run(options: &Options) -> Outcome<()> {
    for file in [Some(options.scene_file()), options.has_room().then(|| options.desk_file())].into_iter().flatten() {
        bevy_mirrorball::authoring::read_scene_components(&file)?;
    }
    if options.is_headless {
        return headless::run(options);
    }
    if !has_display() {
        println!("dance_stage: no display, drawing {} pictures to {}", options.frames, options.out.display());
        return headless::run(options);
    }
    window::run(options, window::fade_styles)
}

/// Returns a feed and the size of its frames. Checks that it exists, but opens nothing that could take long.
pub(crate) fn open_feed(feed: &Feed) -> Outcome<(CameraFeed, UVec2)> {
    Ok(match feed {
        Feed::Clip(folder) => (CameraFeed::clip(folder), Clip::open(folder)?.size),
        Feed::Image(path) => {
            let (width, height) = image::image_dimensions(path)
                .map_err(|error| format!("cannot read the picture {}: {error}", path.display()))?;
            (CameraFeed::file(path), UVec2::new(width, height))
        }
        Feed::Device(index) => (device_feed(*index)?, DEVICE_SIZE),
    })
}

#[cfg(feature = "webcam")]
fn device_feed(index: u32) -> Result<CameraFeed, &'static str> {
    Ok(CameraFeed::device(index))
}

#[cfg(not(feature = "webcam"))]
fn device_feed(_: u32) -> Result<CameraFeed, &'static str> {
    Err("this program was built without webcams; build it with `--features egui,webcam`")
}

/// Reads the song, or sets arrows to music, and saves them if that is asked for.
pub(crate) fn open_song(options: &Options) -> Outcome<Song> {
    let (path, file) = match &options.song {
        SongFile::Steps(path) => (path, Simfile::open(path)?),
        SongFile::Music(path) => {
            println!("dance_stage: setting arrows to {}", path.display());
            (path, composer::compose_file(path, options.seed)?)
        }
    };
    if let Some(path) = &options.save_song {
        std::fs::write(path, file.to_sm()).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        println!("dance_stage: wrote the arrows to {}", path.display());
    }
    let song = Song { file, folder: path.parent().unwrap_or(Path::new(".")).to_owned() };
    if let Some(music) = song.music().filter(|music| !music.exists()) {
        println!("dance_stage: there is no {}, so the song is silent", music.display());
    }
    Ok(song)
}

/// Returns the asset plugin with the scene's folder as the asset folder.
pub(crate) fn asset_plugin(options: &Options) -> Outcome<AssetPlugin> {
    let scene = std::path::absolute(options.scene_file())?;
    let folder = scene.parent().unwrap_or(Path::new("."));
    // Files that the command line names may be anywhere.
    let unapproved_path_mode = UnapprovedPathMode::Allow;
    Ok(AssetPlugin { file_path: folder.to_string_lossy().into_owned(), unapproved_path_mode, ..default() })
}
