//! Shorter exposures between the frames that are shown.

use super::search::{Gate, Gated};
use super::{SIZE, gray, player, state, statistics, update_until, write_clip};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{
    camera::{FeedState, FramePixels, ShorterFrames},
    prelude::*,
    tracking::{MarkerDetection, TrackingPlugin},
};
use std::{path::PathBuf, time::Duration};

/// Shorter exposures beside a camera: each with its brightness.
fn shorter(app: &App, camera: Entity) -> Vec<(f32, u8)> {
    let frames = app.world().get::<ShorterFrames>(camera);
    frames.iter().flat_map(|frames| frames.iter()).map(|frame| (frame.exposure, frame.pixels.rgb8(3, 3)[1])).collect()
}

/// Two usual pictures, a quarter of their exposure, a usual one and a tenth, again and again.
fn write_series(name: &str) -> PathBuf {
    let sidecar = r#"{"image": [8, 6], "fps": 10, "exposures": [1, 1, 0.25, 1, 0.1]}"#;
    let grays: Vec<(String, u8)> = (0..10).map(|i| (format!("{i}.png"), 10 * i)).collect();
    let grays: Vec<(&str, u8)> = grays.iter().map(|(name, gray)| (name.as_str(), *gray)).collect();
    write_clip(name, sidecar, &grays)
}

#[test]
fn shorter_exposures_of_a_clip_are_kept_beside_the_camera_and_never_shown() {
    let mut app = player();
    let feed = CameraFeed::clip(write_series("series")).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    let mut seen = Vec::new();
    for expected in [0, 10, 30, 50, 60, 80, 0] {
        app.update();
        assert_eq!(gray(&app, camera), Some(expected));
        seen.push(shorter(&app, camera));
    }
    assert_eq!(seen[1], []);
    assert_eq!(seen[2], [(0.25, 20)]);
    assert_eq!(seen[4], [(0.25, 20), (0.1, 40)]);
    assert_eq!(seen[6], [(0.25, 70), (0.1, 90)], "the newest of each, in the order of their arrival");
    let statistics = statistics(&app, camera);
    assert_eq!((statistics.pictures, statistics.shorter, statistics.dropped), (7, 4, 0));
    let captured: Vec<_> =
        app.world().get::<ShorterFrames>(camera).expect("arrived").iter().map(|f| f.captured).collect();
    assert_eq!(captured, [700, 900].map(Duration::from_millis), "the recording's own time");
}

#[test]
fn a_slow_game_sees_the_newest_picture_of_each_exposure_and_only_usual_ones_count_as_dropped() {
    let mut app = player();
    // Two fifths of the pictures of a second are short ones.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(1000)));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::clip(write_series("slow_series")))).id();
    assert!(update_until(&mut app, |app| statistics(app, camera).pictures >= 6));
    let statistics = statistics(&app, camera);
    // A picture may be decoded over several updates.
    assert_eq!(shorter(&app, camera).len(), 2);
    assert!([30, 80, 50, 0].contains(&gray(&app, camera).expect("plays")), "{:?}", gray(&app, camera));
    let delivered = (statistics.pictures + statistics.dropped) as f32;
    let seconds = app.world().get::<CameraFrame>(camera).expect("plays").captured.as_secs_f32();
    assert!((statistics.capture_rate - 6.0).abs() < 0.7, "{statistics:?}, {delivered} in {seconds} s");
}

#[test]
fn a_game_may_supply_shorter_exposures_which_nobody_searches_for_markers() {
    let mut app = player();
    // Its gate stays shut: a search would never end.
    app.insert_resource(MarkerDetection::new(Gated(Gate::default()))).add_plugins(TrackingPlugin);
    let pixels = |gray: u8| FramePixels::new(SIZE, vec![gray; 4 * 48]).expect("fits");
    let feed = CameraFeed::pixels(pixels(40)).with_exposure(0.125).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    app.update();
    app.update();
    assert_eq!((gray(&app, camera), shorter(&app, camera)), (None, vec![(0.125, 40)]));
    assert_eq!(state(&app, camera), FeedState::Playing);
    for wrong in [0.0, -0.5, 1.5, f32::NAN] {
        app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(pixels(50)).with_exposure(wrong));
        app.update();
        let FeedState::Failed(reason) = state(&app, camera) else { panic!("{:?}", state(&app, camera)) };
        assert!(reason.contains("with_exposure") && reason.contains("at most 1"), "{reason}");
    }
    assert_eq!((gray(&app, camera), shorter(&app, camera)), (None, vec![(0.125, 40)]));
}
