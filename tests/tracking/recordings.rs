//! What a camera saw is played back with the same poses.

use crate::rendered_marker::MarkerDesk;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, Clip},
    prelude::*,
    tracking::{FilterUse, FrameRecorder, MarkerTracking, PoseFilter, TrackingPlugin, marker_cells},
};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(250.0), Vec2::new(131.0, 97.0), UVec2::new(256, 192));
const FRAMES: u32 = 24;
/// Frames before recording starts.
const BEFORE: u32 = 8;

fn scratch(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin, TrackingPlugin));
    app
}

fn camera_from_marker(app: &App, anchor: Entity) -> Isometry3d {
    let tracking = app.world().get::<MarkerTracking>(anchor).expect("comes with the anchor");
    tracking.camera_from_marker.expect("tracked")
}

/// A camera that shakes, at uneven times.
fn frame(desk: &MarkerDesk, i: u32) -> CameraFrame {
    let eye = Vec3::new(0.02 * (1.3 * i as f32).sin(), 0.3, 0.25 + 0.001 * i as f32);
    let pose = Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y).to_isometry().inverse();
    let captured = Duration::from_millis(u64::from(40 * i + 7 * (i % 3)));
    CameraFrame::new(desk.frame(pose, i.into()), i.into(), captured)
}

#[test]
fn a_recording_has_the_poses_of_its_feed_to_the_last_bit() {
    let folder = scratch("recording");
    let desk = MarkerDesk::new(INTRINSICS, marker_cells(0).expect("tag36h11 has it"), 0.1);
    let mut app = app();
    let camera = app.world_mut().spawn(ArCamera::new(INTRINSICS)).id();
    let filter = PoseFilter { filter: FilterUse::Always, min_cutoff: 0.7, ..default() };
    let anchor = app.world_mut().spawn((MarkerAnchor::new(0, 0.1), filter)).id();
    let mut seen = Vec::new();
    for i in 0..FRAMES {
        if i == BEFORE {
            app.world_mut().entity_mut(camera).insert(FrameRecorder::new(&folder));
        }
        app.world_mut().entity_mut(camera).insert(frame(&desk, i));
        app.update();
        seen.push(camera_from_marker(&app, anchor));
    }
    app.world_mut().entity_mut(camera).remove::<FrameRecorder>();
    let started = Instant::now();
    let is_written = || Clip::open(&folder).is_ok_and(|clip| clip.times.len() == (FRAMES - BEFORE) as usize);
    while !is_written() {
        assert!(started.elapsed() < Duration::from_secs(20), "the recording is written");
        std::thread::sleep(Duration::from_millis(20));
    }

    let mut app = self::app();
    let feed = CameraFeed::clip(&folder).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((ArCamera::default(), feed));
    // By itself, the anchor would not be filtered in a clip.
    let anchor = app.world_mut().spawn(MarkerAnchor::new(0, 0.1)).id();
    for (i, expected) in seen[BEFORE as usize..].iter().enumerate() {
        app.update();
        assert_eq!(camera_from_marker(&app, anchor), *expected, "frame {i}");
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_an_error_of_the_recorder() {
    let file = scratch("a_file_and_no_folder");
    std::fs::write(&file, "").expect("written");
    let desk = MarkerDesk::new(INTRINSICS, marker_cells(0).expect("tag36h11 has it"), 0.1);
    let mut app = app();
    let camera = app.world_mut().spawn((ArCamera::new(INTRINSICS), FrameRecorder::new(&file), frame(&desk, 1))).id();
    let started = Instant::now();
    let error = loop {
        app.update();
        if let Some(error) = app.world().get::<FrameRecorder>(camera).expect("a recorder").error() {
            break error;
        }
        assert!(started.elapsed() < Duration::from_secs(20), "no error");
    };
    assert!(error.contains("a_file_and_no_folder"), "{error}");
}

#[test]
fn a_sidecar_with_unreadable_tracking_plays_as_a_clip() {
    let folder = scratch("unreadable_tracking");
    std::fs::create_dir_all(&folder).expect("created");
    std::fs::copy("assets/desk_clip/frame_000.jpg", folder.join("frame_000.jpg")).expect("shipped");
    let sidecar = r#"{"image": [640, 480], "fps": 15, "tracking": {"is_live": "yes"}}"#;
    std::fs::write(folder.join("clip.json"), sidecar).expect("written");
    let mut app = app();
    let feed = CameraFeed::clip(&folder).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((ArCamera::new(INTRINSICS.scaled_to(UVec2::new(640, 480))), feed));
    let anchor = app.world_mut().spawn(MarkerAnchor::new(0, 0.1)).id();
    app.update();
    assert!(camera_from_marker(&app, anchor).translation.is_finite());
}
