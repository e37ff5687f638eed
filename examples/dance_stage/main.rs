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
//!
//! It runs in browsers too (`scripts/web.sh`): what differs there is in [`platform`].

#![cfg_attr(target_arch = "wasm32", expect(dead_code, reason = "a page has no files, and draws into its canvas only"))]

#[cfg(not(target_arch = "wasm32"))]
mod composer;
mod dancer;
mod game;
#[path = "../support/dance_mat.rs"]
mod dance_mat;
#[cfg(not(target_arch = "wasm32"))]
mod headless;
mod hud;
mod mat;
mod options;
mod places;
#[cfg_attr(not(target_arch = "wasm32"), path = "desktop.rs")]
#[cfg_attr(target_arch = "wasm32", path = "web/mod.rs")]
mod platform;
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
#[cfg(not(target_arch = "wasm32"))]
mod warm_up;
mod window;

use bevy::{asset::AssetPath, gltf::GltfAssetLabel, prelude::*};
use bevy_mirrorball::prelude::*;
use dance_mat::DanceMat;
use game::{Choice, Song};
use options::Options;
use places::PlacePlugin;
use stage::StartAsToon;
use std::process::ExitCode;
use support::{Outcome, scene_path};

fn main() -> ExitCode {
    platform::main()
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
        let song = platform::open_song(options)?;
        if options.scene.is_none() {
            platform::check_dancer(&options.dancer)?;
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

/// Spawns the default dome for scenes that have none.
fn spawn_dome(mut commands: Commands) {
    commands.spawn(ShadowDomeLight::default());
}
