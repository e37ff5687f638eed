//! Recorded clips.

use super::{SIDECAR, gray, player, state, statistics, update_until, write_clip};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{
    camera::{Clip, FeedState},
    prelude::*,
};
use std::{path::Path, time::Duration};

#[test]
fn in_lockstep_every_update_shows_the_next_picture_of_the_loop() {
    let folder = write_clip("lockstep", SIDECAR, &[("f10.png", 30), ("f9.png", 20), ("f1.png", 10)]);
    let mut app = player();
    let feed = CameraFeed::clip(folder).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    for (i, expected) in [10, 20, 30, 10, 20].into_iter().enumerate() {
        app.update();
        let frame = app.world().get::<CameraFrame>(camera).expect("one picture an update").clone();
        assert_eq!((gray(&app, camera), frame.sequence), (Some(expected), i as u64 + 1));
        assert_eq!(frame.captured, Duration::from_millis(100 * i as u64), "the recording's own time");
        let intrinsics = ArCamera::default().intrinsics_for(&frame);
        assert_eq!((intrinsics.focal, intrinsics.center), (Vec2::splat(7.0), Vec2::new(4.0, 3.0)), "the sidecar's");
    }
    assert_eq!((state(&app, camera), statistics(&app, camera).dropped), (FeedState::Playing, 0));
}

#[test]
fn listed_files_are_played_in_the_order_of_the_list() {
    let sidecar = r#"{"image": [8, 6], "fps": 10, "files": ["b.png", "a.png", "b.png"]}"#;
    let folder = write_clip("listed", sidecar, &[("a.png", 10), ("b.png", 20), ("c.png", 30)]);
    let mut app = player();
    let feed = CameraFeed::clip(folder).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    for expected in [20, 10, 20, 20] {
        app.update();
        assert_eq!(gray(&app, camera), Some(expected));
    }
}

#[test]
fn a_slow_game_sees_the_newest_picture_and_counts_the_others() {
    let grays: Vec<(String, u8)> = (0..10).map(|i| (format!("{i}.png"), 10 * i)).collect();
    let grays: Vec<(&str, u8)> = grays.iter().map(|(name, gray)| (name.as_str(), *gray)).collect();
    let folder = write_clip("slow", SIDECAR, &grays);
    let mut app = player();
    // Three and a half pictures an update.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(350)));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::clip(folder))).id();
    assert!(update_until(&mut app, |app| statistics(app, camera).frames >= 5));
    let (statistics, frame) =
        (statistics(&app, camera), app.world().get::<CameraFrame>(camera).expect("plays").clone());
    let start = app.world().resource::<Time<Real>>().elapsed() - frame.captured;
    assert!(start > Duration::ZERO && statistics.dropped > statistics.frames, "{statistics:?}");
    assert!((statistics.capture_rate - 10.0).abs() < 0.5, "{statistics:?}");
}

#[test]
fn a_damaged_picture_is_a_state_and_the_next_good_one_ends_it() {
    let folder = write_clip("damaged", SIDECAR, &[("a.png", 10), ("c.png", 30)]);
    std::fs::write(folder.join("b.png"), b"no picture").expect("written");
    let mut app = player();
    let feed = CameraFeed::clip(&folder).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    app.update();
    app.update();
    let FeedState::Lost(reason) = state(&app, camera) else { panic!("{:?}", state(&app, camera)) };
    assert!(reason.contains("b.png"), "{reason}");
    assert_eq!((gray(&app, camera), statistics(&app, camera).dropped), (Some(10), 1), "the last good picture stays");
    app.update();
    assert_eq!((gray(&app, camera), state(&app, camera)), (Some(30), FeedState::Playing));
}

#[test]
fn what_is_wrong_with_a_clip_is_said_with_file_and_field() {
    let cases: [(&str, &str, &[&str]); 13] = [
        ("no_fps", r#"{"image": [8, 6]}"#, &["clip.json", "fps"]),
        ("bad_fps", r#"{"image": [8, 6], "fps": 0}"#, &["clip.json", "fps", "above 0"]),
        ("slow_fps", r#"{"image": [8, 6], "fps": 1e-30}"#, &["clip.json", "fps", "0.001 to 1000"]),
        ("fast_fps", r#"{"image": [8, 6], "fps": 1e30}"#, &["clip.json", "fps", "0.001 to 1000"]),
        ("bad_size", r#"{"image": [8, 0], "fps": 10}"#, &["clip.json", "image"]),
        (
            "bad_focal",
            r#"{"image": [8, 6], "fps": 10, "intrinsics": {"fx": -7, "fy": 7, "cx": 4, "cy": 3}}"#,
            &["clip.json", "intrinsics", "fx -7"],
        ),
        (
            "zero_exposure",
            r#"{"image": [8, 6], "fps": 10, "exposures": [1, 0]}"#,
            &["clip.json", "exposures", "[1.0, 0.0]", "above 0 and at most 1"],
        ),
        (
            "long_exposure",
            r#"{"image": [8, 6], "fps": 10, "exposures": [1, 2]}"#,
            &["clip.json", "exposures", "2.0", "at most 1"],
        ),
        (
            "none_shown",
            r#"{"image": [8, 6], "fps": 10, "exposures": [0.5]}"#,
            &["clip.json", "exposures", "1 for the frames that are shown"],
        ),
        ("bad_json", r#"{"image": [8, 6], "#, &["clip.json", "line 1"]),
        (
            "elsewhere",
            r#"{"image": [8, 6], "fps": 10, "files": ["f1.png", "../f1.png"]}"#,
            &["clip.json", "files", "../f1.png", "without folders"],
        ),
        ("no_files", r#"{"image": [8, 6], "fps": 10, "files": []}"#, &["no images", "no_files"]),
        ("no_match", r#"{"image": [8, 6], "fps": 10, "pattern": "g*.png"}"#, &["no_match", "g*.png"]),
    ];
    for (name, sidecar, expected) in cases {
        let folder = write_clip(name, sidecar, &[("f1.png", 10)]);
        let error = Clip::open(&folder).expect_err(name).to_string();
        assert!(expected.iter().all(|part| error.contains(part)), "{error}");
    }
    let missing = Path::new(env!("CARGO_TARGET_TMPDIR")).join("no such clip");
    let mut app = player();
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::clip(missing))).id();
    app.update();
    let FeedState::Failed(reason) = state(&app, camera) else { panic!("{:?}", state(&app, camera)) };
    assert!(reason.contains("no such clip") && reason.contains("clip.json"), "{reason}");
}
