//! Frames of lenses that bend lines are undistorted once, on every way that they take.

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{BracketedFrames, CameraFrame, CameraPlugin, Distortion, FramePixels, UndistortionMap},
    prelude::*,
    tracking::TrackingPlugin,
};
use std::time::{Duration, Instant};

const SIZE: UVec2 = UVec2::new(64, 48);

fn lens(k1: f32) -> Intrinsics {
    let distortion = Distortion { k1, ..Distortion::NONE };
    Intrinsics { distortion, ..Intrinsics::new(Vec2::splat(50.0), Vec2::new(31.0, 25.0), SIZE) }
}

fn frame() -> FramePixels {
    let rgba = (0..SIZE.x * SIZE.y).flat_map(|i| [(i * 31) as u8, (i / 7) as u8, (i % 64) as u8, 255]);
    FramePixels::new(SIZE, rgba.collect()).expect("as many bytes as the size says")
}

fn undistorted(k1: f32) -> Vec<u8> {
    UndistortionMap::new(&lens(k1)).undistort(&frame()).expect("of the size of the map").rgba
}

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), CameraPlugin));
    app
}

fn shown(app: &mut App) -> Option<(u64, Vec<u8>)> {
    let frame = app.world_mut().query::<&CameraFrame>().iter(app.world()).next()?;
    Some((frame.sequence, frame.pixels.rgba.clone()))
}

/// Updates until a frame beyond a number has arrived.
fn wait(app: &mut App, beyond: u64) -> Vec<u8> {
    let started = Instant::now();
    while started.elapsed() < Duration::from_secs(20) {
        app.update();
        if let Some((_, pixels)) = shown(app).filter(|(sequence, _)| *sequence > beyond) {
            // Another update must not undistort it again.
            app.update();
            assert_eq!(shown(app).expect("stays").1, pixels);
            return pixels;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("no frame arrived");
}

#[test]
fn frames_are_undistorted_once_live_or_not_with_tracking_or_without() {
    for has_tracking in [false, true] {
        for pace in [FeedPace::Live, FeedPace::Lockstep] {
            let mut app = app();
            if has_tracking {
                app.add_plugins(TrackingPlugin);
            }
            app.world_mut().spawn((ArCamera::new(lens(-0.25)), CameraFeed::pixels(frame()).with_pace(pace)));
            assert!(wait(&mut app, 0) == undistorted(-0.25), "tracking {has_tracking}, {pace:?}");
        }
    }
}

#[test]
fn bracketed_frames_are_undistorted_too() {
    for pace in [FeedPace::Live, FeedPace::Lockstep] {
        let mut app = app();
        let feed = CameraFeed::pixels(frame()).with_exposure(0.25).with_pace(pace);
        let camera = app.world_mut().spawn((ArCamera::new(lens(-0.25)), feed)).id();
        let started = Instant::now();
        app.update();
        // those of live feeds in the background
        while app.world().get::<BracketedFrames>(camera).is_none() {
            assert!(pace == FeedPace::Live && started.elapsed() < Duration::from_secs(20), "{pace:?}: none arrived");
            std::thread::sleep(Duration::from_millis(1));
            app.update();
        }
        let frames = app.world().get::<BracketedFrames>(camera).expect("there now");
        assert!(frames.iter().all(|frame| frame.pixels.rgba == undistorted(-0.25)) && frames.iter().count() == 1);
    }
}

#[test]
fn a_still_follows_the_lens_of_its_camera() {
    let mut app = app();
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::pixels(frame()))).id();
    assert!(wait(&mut app, 0) == frame().rgba);
    app.world_mut().entity_mut(camera).insert(ArCamera::new(lens(0.2)));
    assert!(wait(&mut app, 1) == undistorted(0.2));
    app.world_mut().get_mut::<ArCamera>(camera).expect("spawned above").fit = FrameFit::Contain;
    app.update();
    assert_eq!(shown(&mut app).expect("stays").0, 2, "the lens has not changed");
}

#[test]
fn frames_of_the_game_and_lenses_of_another_shape_are_left_alone() {
    let mut app = app();
    app.world_mut().spawn((ArCamera::new(lens(-0.25)), CameraFrame::new(frame(), 1, Duration::ZERO)));
    assert!(wait(&mut app, 0) == frame().rgba, "a frame of the game counts as undistorted");
    let mut app = app_with_other_shape();
    assert!(wait(&mut app, 0) == frame().rgba, "a crop that nobody knows");
    let camera = app.world_mut().query::<(&ArCamera, &CameraFrame)>().iter(app.world()).next().expect("spawned");
    let assumed = Intrinsics::from_horizontal_fov(SIZE, 60_f32.to_radians());
    assert!((camera.0.intrinsics_for(camera.1).focal - assumed.focal).length() < 1e-3);
}

fn app_with_other_shape() -> App {
    let mut app = app();
    let wide = Intrinsics { size: UVec2::new(128, 72), center: Vec2::new(64.0, 36.0), ..lens(-0.25) };
    app.world_mut().spawn((ArCamera::new(wide), CameraFeed::pixels(frame())));
    app
}

#[test]
fn a_lens_measured_at_another_size_of_the_same_shape_is_scaled() {
    let mut app = app();
    let large = lens(-0.25).scaled_to(SIZE * 4);
    app.world_mut().spawn((ArCamera::new(large), CameraFeed::pixels(frame())));
    assert!(wait(&mut app, 0) == undistorted(-0.25));
    let (camera, frame) =
        app.world_mut().query::<(&ArCamera, &CameraFrame)>().iter(app.world()).next().expect("spawned");
    assert_eq!(camera.intrinsics_for(frame), Intrinsics { distortion: Distortion::NONE, ..lens(-0.25) });
}
