//! Figures that were not made for the dance game: which of their animations are danced, how fast, and how they stand.

use crate::{
    animations::{MoveAnimation, is_native, of_move, second},
    choreography::Move,
    rest_pose::FigureParts,
    song::Lane,
};
use bevy::{
    animation::AnimationPlugin,
    ecs::system::RunSystemOnce,
    gltf::Gltf,
    prelude::*,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
};
use bevy_mirrorball::headless;
use gltf::Semantic;
use std::{
    path::Path,
    time::{Duration, Instant},
};

const ROBOT: [&str; 7] = ["Dance", "Death", "Idle", "Jump", "Running", "Walking", "Wave"];
/// Longest wait for a file.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Of sums of 32-bit numbers.
const ROUNDING: f32 = 1e-4;

/// An app that loads glTF files and draws nothing.
fn loading_app() -> App {
    let no_renderer = RenderPlugin {
        render_creation: RenderCreation::Automatic(Box::new(WgpuSettings { backends: None, ..default() })),
        ..default()
    };
    let plugins = headless::default_plugins().set(no_renderer);
    headless::build_app(plugins, |app| {
        app.add_plugins(AnimationPlugin);
    })
    .expect("needs no adapter")
}

/// Loads a model of the repository, and returns how it is put on the stage, and the corners of its vertices in the
/// file.
fn fit_of(name: &str, is_native: bool) -> (Transform, [Vec3; 2]) {
    let mut app = loading_app();
    let assets = app.world().resource::<AssetServer>().clone();
    let handle: Handle<Gltf> = assets.load(format!("models/{name}"));
    let started = Instant::now();
    while !assets.is_loaded_with_dependencies(&handle) {
        app.update();
        assert!(started.elapsed() < MAX_WAIT, "{name} does not load");
    }
    let fit = move |parts: FigureParts, files: Res<Assets<Gltf>>| {
        parts.fit(files.get(&handle).expect("is loaded"), is_native).expect("has vertices")
    };
    let fit = app.world_mut().run_system_once(fit).expect("has its parameters");
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models").join(name);
    let file = gltf::Gltf::open(path).expect("a file of the repository");
    let position = file.meshes().flat_map(|mesh| mesh.primitives()).find_map(|part| part.get(&Semantic::Positions));
    let position = position.expect("has vertices");
    let corner = |value: Option<gltf::json::Value>| {
        let numbers: Vec<f32> = serde_json::from_value(value.expect("positions have bounds")).expect("three numbers");
        Vec3::from_slice(&numbers)
    };
    (fit, [corner(position.min()), corner(position.max())])
}

#[test]
fn names_say_what_is_danced() {
    let danced = |what| of_move(what, &ROBOT).map(|found| ROBOT[found.index]);
    assert_eq!(danced(Move::Idle), Some("Dance"));
    assert_eq!(Lane::ALL.map(|lane| danced(Move::Step(lane))), [Some("Walking"); 4]);
    assert_eq!((danced(Move::Jump), danced(Move::Cheer)), (Some("Jump"), Some("Wave")));
    assert_eq!((danced(Move::Spin), danced(Move::Stumble)), (None, None));
    assert_eq!(of_move(Move::Idle, &["a", "b"]), Some(MoveAnimation { index: 0, is_native: false }), "if none says");
    assert_eq!(of_move(Move::Idle, &[]), None);
    let sided = ["strafe_right", "strafe_left"];
    assert_eq!(of_move(Move::Step(Lane::Left), &sided).map(|found| found.index), Some(0), "a mirror image");
}

#[test]
fn files_for_this_game_name_moves_exactly() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/models/dancer.glb");
    let file = gltf::Gltf::open(path).expect("a file of the repository");
    let names: Vec<_> = file.animations().filter_map(|animation| animation.name()).collect();
    assert!(is_native(&names) && !is_native(&ROBOT));
    for what in Move::ALL {
        let found = of_move(what, &names).expect("has all");
        assert_eq!((names[found.index], found.is_native), (what.name(), true));
    }
}

#[test]
fn the_game_s_own_dancer_stands_as_she_is() {
    assert_eq!(fit_of("dancer.glb", true).0, Transform::IDENTITY);
}

#[test]
fn a_fox_is_as_long_as_the_stage_and_faces_the_audience() {
    // Unlike with many figures, the bones of this one leave its vertices where the file has them.
    let (fit, [min, max]) = fit_of("Fox.gltf", false);
    let middle = (min + max) / 2.0;
    let (feet, head) = (fit.transform_point(middle.with_y(min.y)), fit.transform_point(middle.with_y(max.y)));
    assert!(feet.length() < 0.003 && (0.07..0.15).contains(&head.y), "{feet} {head}");
    let [nose, tail] = [max.z, min.z].map(|z| fit.transform_point(middle.with_z(z)));
    assert!(nose.z < 0.0 && (nose.distance(tail) - 0.2).abs() < 0.006, "{nose} {tail}");
}

#[test]
fn repeated_moves_fit_whole_beats_at_about_their_own_pace() {
    // 3.4 seconds are about seven beats.
    let at = |beat: f64| second(Move::Idle, false, 3.4, 0.0, beat);
    assert!(at(0.0).abs() < ROUNDING && at(7.0).abs() < ROUNDING && (at(3.5) - 1.7).abs() < ROUNDING);
    assert!((second(Move::Step(Lane::Up), false, 0.7, 0.5, 9.0) - 0.35).abs() < ROUNDING, "in the middle on the beat");
    assert_eq!(second(Move::Step(Lane::Up), true, 1.0, 0.5, 9.0), 0.5, "seconds are beats");
    assert!(second(Move::Idle, false, 0.0, 0.0, 3.3).is_finite(), "no animation is too short");
}
