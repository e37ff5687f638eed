//! Where relative paths of feeds lead.

use super::{SIDECAR, gray, player, state, update_until, write_clip};
use bevy::prelude::*;
use bevy_mirrorball::{camera::FeedState, prelude::*};
use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// Name of the test that is run in another working directory, and the variable that tells it so.
const CHILD: &str = "feeds::paths::a_relative_path_is_found_in_the_asset_root";
const IS_CHILD: &str = "MIRRORBALL_TEST_OF_PATHS";

fn plays(feed: CameraFeed) -> Option<u8> {
    let mut app = player();
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    assert!(update_until(&mut app, |app| state(app, camera) != FeedState::Waiting), "opened in the end");
    if let Some(problem) = state(&app, camera).problem() {
        println!("{problem}");
    }
    gray(&app, camera)
}

fn lockstep(feed: CameraFeed) -> CameraFeed {
    feed.with_pace(FeedPace::Lockstep)
}

#[test]
fn a_relative_path_is_found_in_the_asset_root() {
    if std::env::var_os(IS_CHILD).is_some() {
        // In the working directory both have 20; in the asset root 70.
        assert_eq!(plays(lockstep(CameraFeed::clip("both"))), Some(20), "the working directory comes first");
        assert_eq!(plays(lockstep(CameraFeed::clip("assets/shipped"))), Some(70));
        assert_eq!(plays(lockstep(CameraFeed::file("assets/shipped/a.png"))), Some(70));
        assert_eq!(plays(CameraFeed::file("assets/shipped/a.png")), Some(70));
        assert_eq!(plays(lockstep(CameraFeed::file("shipped/a.png"))), None, "these are no paths of assets");
        return;
    }
    write_clip("paths/here/both", SIDECAR, &[("a.png", 20)]);
    write_clip("paths/asset_root/both", SIDECAR, &[("a.png", 70)]);
    write_clip("paths/asset_root/assets/shipped", SIDECAR, &[("a.png", 70)]);
    let paths = Path::new(env!("CARGO_TARGET_TMPDIR")).join("paths");
    let mut child = Command::new(std::env::current_exe().expect("this test"));
    child.args([CHILD, "--exact", "--nocapture"]).current_dir(paths.join("here"));
    let output =
        child.env(IS_CHILD, "1").env("BEVY_ASSET_ROOT", paths.join("asset_root")).output().expect("it can be run");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        output.status.success() && said.contains("1 passed"),
        "{said}\n{}",
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn what_is_nowhere_is_said_with_both_places() {
    let working: PathBuf = std::env::current_dir().expect("it exists");
    let root = bevy::asset::io::file::FileAssetReader::get_base_path();
    for (feed, expected) in
        [(CameraFeed::clip("no/such/clip"), "clip.json"), (CameraFeed::file("no/such/photo.jpg"), "PNG, JPEG")]
    {
        let mut app = player();
        let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
        app.update();
        let FeedState::Failed(reason) = state(&app, camera) else { panic!("{:?}", state(&app, camera)) };
        for part in ["no/such/", &*working.to_string_lossy(), &*root.to_string_lossy(), "working directory", expected] {
            assert!(reason.contains(part), "{part} is not in: {reason}");
        }
    }
}
