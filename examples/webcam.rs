//! How do I use my own camera and desk? Print `assets/markers/tag36h11-0.svg`, put a mirrored ball of 10 cm 17 cm to
//! its right and 1 cm towards its bottom edge, and read what this program says is missing.
//!
//! `cargo run --example webcam --features webcam`

#[path = "support/mod.rs"]
mod support;

use bevy::prelude::*;
use bevy_mirrorball::{
    debug::{CheckLevel, Checklist},
    prelude::*,
};
use support::DefaultPlugins; // Bevy's own, or with `--headless` a picture in a file

fn main() -> AppExit {
    App::new()
        .add_plugins((DefaultPlugins, MirrorballPlugins))
        .add_systems(Startup, setup)
        .add_systems(Update, say_what_is_missing)
        .run()
}

fn setup(mut commands: Commands, mut meshes: ResMut<Assets<Mesh>>, mut materials: ResMut<Assets<StandardMaterial>>) {
    // The lens, as the example `calibrate` measured it. Without, 60° are assumed: good enough to see something.
    let intrinsics = Intrinsics::open("calibration.json").ok();
    // The first webcam. One that is missing or unplugged is looked for every second.
    commands.spawn((ArCamera { intrinsics, ..default() }, CameraFeed::device(0)));
    commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
    commands.spawn((LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)));
    let desk = meshes.add(Plane3d::default().mesh().size(1.6, 1.2));
    commands.spawn((PhantomObject { casts: false, ..default() }, Mesh3d(desk)));
    commands.spawn(ShadowDomeLight::default());

    let (sphere, white) = (meshes.add(Sphere::new(0.045)), materials.add(Color::WHITE));
    commands.spawn((Mesh3d(sphere), MeshMaterial3d(white), Transform::from_xyz(-0.13, 0.045, -0.03)));
}

/// Prints the checklist whenever a line gets better or worse.
fn say_what_is_missing(checklist: Checklist, mut said: Local<Vec<CheckLevel>>) {
    let checks = checklist.checks();
    let levels: Vec<CheckLevel> = checks.iter().map(|check| check.level).collect();
    if *said != levels {
        println!();
        for check in checks {
            println!("{:?}: {}: {}", check.level, check.topic, check.text);
        }
        *said = levels;
    }
}
