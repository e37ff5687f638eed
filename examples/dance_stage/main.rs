//! A dancer on a real desk, lit by the light measured in a mirrored ball. Each object can switch between toon and
//! image-based shading.
//!
//! ```text
//! cargo run --example dance_stage --features egui
//! ```
//! Run with `--help` for all options.

mod dancer;
mod headless;
mod options;
mod stage;
#[path = "../support/mod.rs"]
mod support;
mod window;

use bevy::prelude::*;
use bevy_mirrorball::prelude::*;
use options::{Options, USAGE};
use stage::StartAsToon;
use std::{path::Path, process::ExitCode};
use support::{Outcome, has_display, run_with_options, scene_path};

fn main() -> ExitCode {
    run_with_options("dance_stage", USAGE, Options::from_command_line(), run)
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

/// The scene that is shown, in a window or headless.
struct Show {
    scene: Handle<WorldAsset>,
}

impl Show {
    /// Adds the scene and, unless it is the user's (`--scene`), the stage.
    fn add(app: &mut App, options: &Options) -> Outcome<Self> {
        let path = scene_path(&options.scene_file()).ok_or("--scene names no file")?;
        let scene = app.world().resource::<AssetServer>().load(path);
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

/// Spawns the default dome for scenes that have none.
fn spawn_dome(mut commands: Commands) {
    commands.spawn(ShadowDomeLight::default());
}

/// Returns the asset plugin with the scene's folder as the asset folder.
fn asset_plugin(options: &Options) -> Outcome<AssetPlugin> {
    let scene = std::path::absolute(options.scene_file())?;
    let folder = scene.parent().unwrap_or(Path::new("."));
    Ok(AssetPlugin { file_path: folder.to_string_lossy().into_owned(), ..default() })
}
