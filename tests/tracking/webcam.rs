//! What games see of webcams without a camera. Taking pictures from real drivers is tested beside the code, in a
//! virtual machine: `scripts/test_webcam.sh`.

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, DeviceId, DeviceOptions, FeedState, list_devices},
    prelude::*,
};
use std::time::{Duration, Instant};

#[test]
fn cameras_are_listed_by_rising_numbers_wherever_this_runs() {
    let devices = list_devices();
    assert!(devices.is_sorted_by(|a, b| a.index < b.index), "{devices:?}");
    assert_eq!(list_devices(), devices);
}

#[test]
fn a_camera_that_is_missing_is_a_state_that_says_so() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin));
    let options = DeviceOptions { device: DeviceId::Name("no camera is called this".to_owned()), ..default() };
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::device(options))).id();
    let started = Instant::now();
    let reason = loop {
        app.update();
        if let Some(FeedState::Lost(reason)) = app.world().get(camera) {
            break reason.clone();
        }
        assert!(started.elapsed() < Duration::from_secs(20), "{:?}", app.world().get::<FeedState>(camera));
        std::thread::sleep(Duration::from_millis(2));
    };
    assert!(reason.contains("no camera is called this"), "{reason}");
    assert!(app.world().get::<CameraFrame>(camera).is_none());
}
