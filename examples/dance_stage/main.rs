//! A dancer on a real desk, lit by the room that a mirrored ball shows; every thing switches between toon and
//! image-based.
//!
//! ```text
//! cargo run --example dance_stage --features egui
//! ```
//! Run with `--help` for all options.

mod dancer;
mod headless;
mod options;
mod stage;
mod window;

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use options::{Options, USAGE};
use stage::StartAsToon;
use std::{io::Write, path::Path, process::ExitCode};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    let result = match Options::from_command_line() {
        Ok(Some(options)) => run(&options),
        // Whoever reads the help may stop early, as `head` does.
        Ok(None) => writeln!(std::io::stdout(), "{USAGE}").or(Ok(())),
        Err(error) => Err(error.into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("dance_stage: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(options: &Options) -> Outcome<()> {
    bevy_mirrorball::authoring::read_scene_components(&options.scene_file())?;
    if options.is_headless {
        return headless::run(options);
    }
    if !has_display() {
        println!("dance_stage: no display, drawing {} pictures to {}", options.frames, options.out.display());
        return headless::run(options);
    }
    window::run(options)
}

/// Whether a window can be opened. Elsewhere than on Linux there is always a desktop.
fn has_display() -> bool {
    !cfg!(target_os = "linux") || std::env::var_os("DISPLAY").is_some_and(|display| !display.is_empty())
}

/// What is shown, in a window or not.
struct Show {
    scene: Handle<WorldAsset>,
}

impl Show {
    /// Adds the scene and, unless the user brought a scene, the stage.
    fn add(app: &mut App, options: &Options) -> Outcome<Self> {
        let file = options.scene_file();
        let name = file.file_name().ok_or("--scene names no file")?.to_string_lossy().into_owned();
        let scene = app.world().resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset(name));
        app.world_mut().spawn(WorldAssetRoot(scene.clone()));
        let lacks_dome = any_with_component::<MarkerAnchor>.and_then(not(any_with_component::<ShadowDomeLight>));
        app.add_systems(Update, spawn_dome.run_if(lacks_dome)).init_resource::<dancer::Dance>();
        if options.scene.is_none() {
            app.insert_resource(StartAsToon(options.toons.clone()))
                .add_systems(Startup, (stage::spawn, stage::start_as_toon).chain())
                .add_systems(Update, (dancer::keep_the_beat, dancer::dance).chain());
        }
        Ok(Self { scene })
    }
}

/// A scene that says nothing of shadows has those of the default dome.
fn spawn_dome(mut commands: Commands) {
    commands.spawn(ShadowDomeLight::default());
}

/// Bevy's assets are those beside the scene.
fn asset_plugin(options: &Options) -> Outcome<AssetPlugin> {
    let scene = std::path::absolute(options.scene_file())?;
    let folder = scene.parent().unwrap_or(Path::new("."));
    Ok(AssetPlugin { file_path: folder.to_string_lossy().into_owned(), ..default() })
}
