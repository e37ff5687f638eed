//! Recorded clips that the asset server loads.

use super::{SIDECAR, gray, state, update_until, write_clip};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, ClipAsset, FeedState},
    prelude::*,
};
use std::path::Path;

/// An app that plays feeds, and whose assets are in a folder.
fn player_of(assets: &Path) -> App {
    let mut app = App::new();
    let file_path = assets.to_string_lossy().into_owned();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin { file_path, ..default() }, CameraPlugin));
    app
}

/// Plays the clip in a folder as an asset.
fn play(app: &mut App, sidecar: &str, pace: FeedPace) -> Entity {
    let clip: Handle<ClipAsset> = app.world().resource::<AssetServer>().load(sidecar.to_owned());
    app.world_mut().spawn((ArCamera::default(), CameraFeed::clip_asset(clip).with_pace(pace))).id()
}

/// Why the feed of a clip fails.
fn failure(name: &str, sidecar: &str) -> String {
    let folder = write_clip(name, sidecar, &[("a.png", 10)]);
    let mut app = player_of(&folder);
    let camera = play(&mut app, "clip.json", FeedPace::Live);
    assert!(update_until(&mut app, |app| state(app, camera) != FeedState::Waiting));
    match state(&app, camera) {
        FeedState::Failed(reason) => reason,
        other => panic!("{other:?}"),
    }
}

#[test]
fn an_asset_plays_as_the_folder_does() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let mut app = player_of(&root);
    let asset = play(&mut app, "desk_clip/clip.json", FeedPace::Lockstep);
    app.update();
    assert_eq!(state(&app, asset), FeedState::Waiting, "files are read in the background");
    assert!(update_until(&mut app, |app| app.world().get::<CameraFrame>(asset).is_some()));
    let feed = CameraFeed::clip(root.join("desk_clip")).with_pace(FeedPace::Lockstep);
    let folder = app.world_mut().spawn((ArCamera::default(), feed)).id();
    let first = app.world().get::<CameraFrame>(asset).expect("plays").clone();
    app.update();
    let frame = |app: &App, camera| app.world().get::<CameraFrame>(camera).expect("plays").clone();
    assert_eq!(frame(&app, folder).pixels.rgba, first.pixels.rgba, "the first frames");
    assert_eq!(frame(&app, folder).intrinsics, first.intrinsics);
    let second = frame(&app, asset);
    app.update();
    assert_eq!(frame(&app, folder).pixels.rgba, second.pixels.rgba, "the second ones");
    assert_eq!(frame(&app, folder).captured, second.captured);
}

#[test]
fn a_live_asset_waits_until_it_is_loaded() {
    let sidecar = SIDECAR.replacen('{', r#"{"files": ["b.png", "a.png"], "#, 1);
    let folder = write_clip("live_asset", &sidecar, &[("a.png", 10), ("b.png", 20)]);
    let mut app = player_of(&folder);
    let camera = play(&mut app, "clip.json", FeedPace::Live);
    assert!(update_until(&mut app, |app| state(app, camera) == FeedState::Playing));
    assert!(gray(&app, camera).is_some());
}

#[test]
fn what_cannot_be_loaded_is_said() {
    let reason = failure("no_list", r#"{"image": [8, 6], "fps": 10}"#);
    assert!(reason.contains("clip.json") && reason.contains("\"files\""), "{reason}");
    let reason = failure("no_picture", r#"{"image": [8, 6], "fps": 10, "files": ["a.png", "z.png"]}"#);
    assert!(reason.contains("z.png") && reason.contains("files"), "{reason}");
    let reason = failure("bad_text", r#"{"image": "#);
    assert!(reason.contains("clip.json") && reason.contains("line 1"), "{reason}");
}
