//! A dance game on a real desk, lit by the light measured in a mirrored ball. Each object can switch between toon and
//! image-based shading.
//!
//! ```text
//! cargo run --example dance_stage --features egui
//! ```
//! Run with `--help` for all options.
//!
//! [`song`] has the arrows and their times, [`rules`] says what steps on them are worth, [`game`] lets players step,
//! [`hud`] shows it, and [`dancer`] dances it. None of these knows of camera, marker or light: [`stage`] puts things on
//! the marker, and the plugin does the rest. With `--solo` there is no camera: the dancer is in one of the [`places`].

mod composer;
mod dancer;
mod game;
#[path = "../support/dance_mat.rs"]
mod dance_mat;
mod headless;
mod hud;
mod mat;
mod options;
mod places;
#[expect(dead_code, reason = "tests need more of it")]
mod random;
mod remembered;
mod result_file;
#[expect(dead_code, unused_imports, reason = "its tests need more of it")]
mod rules;
#[expect(dead_code, unused_imports, reason = "the composer and its tests need more of it")]
mod song;
mod stage;
mod stage_lights;
#[path = "../support/mod.rs"]
mod support;
mod usage;
mod view;
mod window;

use bevy::{
    asset::{AssetPath, UnapprovedPathMode},
    gltf::GltfAssetLabel,
    prelude::*,
};
use bevy_mirrorball::prelude::*;
use dance_mat::DanceMat;
use game::{Choice, Song};
use options::{Options, SongFile};
use places::PlacePlugin;
use song::Simfile;
use stage::StartAsToon;
use std::{path::Path, process::ExitCode};
use support::{Outcome, has_display, run_with_options, scene_path};
use usage::USAGE;

fn main() -> ExitCode {
    run_with_options("dance_stage", USAGE, Options::from_command_line(), run)
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
    window::run(options)
}

/// What is shown, in a window or headless.
struct Show<'a> {
    options: &'a Options,
    song: Song,
    choice: Choice,
    scene: AssetPath<'static>,
    /// The set of the desk on which the scene is a model.
    desk: Option<AssetPath<'static>>,
}

impl<'a> Show<'a> {
    fn open(options: &'a Options, choice: Choice) -> Outcome<Self> {
        let scene = scene_path(&options.scene_file()).ok_or("--scene names no file")?;
        let song = open_song(options)?;
        if options.scene.is_none() {
            dancer::check_file(&options.dancer)?;
        }
        let desk = options.has_room().then(|| std::path::absolute(options.desk_file())).transpose()?;
        let desk = desk.map(|file| GltfAssetLabel::Scene(0).from_asset(AssetPath::from_path_buf(file)));
        Ok(Self { options, song, choice, scene, desk })
    }

    /// Adds the game, the scene and, unless that is a place or the user's (`--scene`), the stage. Returns the scene.
    fn build(self, app: &mut App) -> Handle<WorldAsset> {
        let Self { options, song, choice, scene, desk } = self;
        let lacks_dome = any_with_component::<MarkerAnchor>.and_then(not(any_with_component::<ShadowDomeLight>));
        app.insert_resource(choice)
            .insert_resource(song)
            .add_plugins((game::DanceGamePlugin, dancer::DancerPlugin, hud::HudPlugin))
            .add_systems(Update, spawn_dome.run_if(lacks_dome));
        if options.scene.is_none() {
            app.insert_resource(StartAsToon(options.toons.clone()))
                .insert_resource(dancer::DancerFile(options.dancer.clone()))
                .add_systems(Startup, (dancer::spawn, stage::start_as_toon).chain());
        }
        if let Some(width) = options.mat {
            mat::spawn(app.world_mut(), DanceMat::of_width(width), options.has_shoes);
        }
        if let Some(place) = options.place {
            app.add_plugins(PlacePlugin { place, has_room: options.has_room() });
            return places::spawn(app.world_mut(), place, scene, desk);
        }
        if options.scene.is_none() {
            app.add_plugins(stage_lights::StageLightsPlugin)
                .add_systems(Startup, stage::spawn.before(stage::start_as_toon));
        }
        let scene = app.world().resource::<AssetServer>().load(scene);
        app.world_mut().spawn(WorldAssetRoot(scene.clone()));
        scene
    }
}

/// Reads the song, or sets arrows to music, and saves them if that is asked for.
fn open_song(options: &Options) -> Outcome<Song> {
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

/// Spawns the default dome for scenes that have none.
fn spawn_dome(mut commands: Commands) {
    commands.spawn(ShadowDomeLight::default());
}

/// Returns the asset plugin with the scene's folder as the asset folder.
fn asset_plugin(options: &Options) -> Outcome<AssetPlugin> {
    let scene = std::path::absolute(options.scene_file())?;
    let folder = scene.parent().unwrap_or(Path::new("."));
    // Files that the command line names may be anywhere.
    let unapproved_path_mode = UnapprovedPathMode::Allow;
    Ok(AssetPlugin { file_path: folder.to_string_lossy().into_owned(), unapproved_path_mode, ..default() })
}
