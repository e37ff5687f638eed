//! Pictures come from clips, images and games, in the background or in lockstep, and trouble is a state.

mod gpu;

use bevy::{
    asset::RenderAssetUsages,
    camera::RenderTarget,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    time::TimeUpdateStrategy,
};
use bevy_mirrorball::{
    camera::{BracketedFrames, CameraPlugin, Clip, FeedState, FeedStatistics, FramePixels},
    headless,
    prelude::*,
    tracking::{DetectedMarker, DetectedMarkers, LumaView, MarkerDetection, MarkerDetector, TrackingPlugin},
};
use std::{
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex},
    time::{Duration, Instant},
};

const SIZE: UVec2 = UVec2::new(8, 6);
/// To wait for what happens in the background.
const PATIENCE: Duration = Duration::from_secs(60);

/// An app that plays feeds and draws nothing.
fn player() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin));
    app
}

/// A clip of solid gray pictures in a folder of its own: `names` with their brightness, beside a sidecar.
fn write_clip(name: &str, sidecar: &str, pictures: &[(&str, u8)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("the target folder can be written to");
    std::fs::write(folder.join("clip.json"), sidecar).expect("written");
    for (name, gray) in pictures {
        image::GrayImage::from_pixel(SIZE.x, SIZE.y, image::Luma([*gray])).save(folder.join(name)).expect("written");
    }
    folder
}

const SIDECAR: &str =
    r#"{"image": [8, 6], "fps": 10, "intrinsics": {"fx": 7, "fy": 7, "cx": 4, "cy": 3}, "made by": "a test"}"#;

fn state(app: &App, camera: Entity) -> FeedState {
    app.world().get::<FeedState>(camera).expect("comes with the feed").clone()
}

fn statistics(app: &App, camera: Entity) -> FeedStatistics {
    app.world().get::<FeedStatistics>(camera).expect("comes with the feed").clone()
}

fn gray(app: &App, camera: Entity) -> Option<u8> {
    app.world().get::<CameraFrame>(camera).map(|frame| frame.pixels.rgb8(3, 3)[1])
}

/// Updates until something is true, at most for [`PATIENCE`].
fn update_until(app: &mut App, mut done: impl FnMut(&mut App) -> bool) -> bool {
    let started = Instant::now();
    while started.elapsed() < PATIENCE {
        app.update();
        if done(app) {
            return true;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    false
}

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

/// Shorter exposures beside a camera: each with its brightness.
fn shorter(app: &App, camera: Entity) -> Vec<(f32, u8)> {
    let frames = app.world().get::<BracketedFrames>(camera);
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
    assert_eq!((statistics.frames, statistics.bracketed, statistics.dropped), (7, 4, 0));
    let captured: Vec<_> =
        app.world().get::<BracketedFrames>(camera).expect("arrived").iter().map(|f| f.captured).collect();
    assert_eq!(captured, [700, 900].map(Duration::from_millis), "the recording's own time");
}

#[test]
fn a_slow_game_sees_the_newest_picture_of_each_exposure_and_only_usual_ones_count_as_dropped() {
    let mut app = player();
    // Two fifths of the pictures of a second are short ones.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(1000)));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::clip(write_series("slow_series")))).id();
    assert!(update_until(&mut app, |app| statistics(app, camera).frames >= 6));
    let statistics = statistics(&app, camera);
    // A picture may be decoded over several updates.
    assert_eq!(shorter(&app, camera).len(), 2);
    assert!([30, 80, 50, 0].contains(&gray(&app, camera).expect("plays")), "{:?}", gray(&app, camera));
    let delivered = (statistics.frames + statistics.dropped) as f32;
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
    let cases: [(&str, &str, &[&str]); 9] = [
        ("no_fps", r#"{"image": [8, 6]}"#, &["clip.json", "fps"]),
        ("bad_fps", r#"{"image": [8, 6], "fps": 0}"#, &["clip.json", "fps", "above 0"]),
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

#[test]
fn a_picture_file_is_decoded_in_the_background() {
    let folder = write_clip("still", SIDECAR, &[("still.png", 77)]);
    let mut app = player();
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::file(folder.join("still.png")))).id();
    assert!(update_until(&mut app, |app| gray(app, camera).is_some()));
    assert_eq!((gray(&app, camera), state(&app, camera)), (Some(77), FeedState::Playing));
    // A wrong name is noticed, the last picture stays, and another feed takes over.
    app.world_mut().entity_mut(camera).insert(CameraFeed::file(folder.join("nothing.png")));
    assert!(update_until(&mut app, |app| matches!(state(app, camera), FeedState::Failed(_))));
    assert_eq!(gray(&app, camera), Some(77));
    app.world_mut().entity_mut(camera).insert(CameraFeed::file(folder.join("still.png")));
    assert!(update_until(&mut app, |app| state(app, camera) == FeedState::Playing));
}

fn solid_image(gray: u8, format: TextureFormat) -> Image {
    let size = Extent3d { width: SIZE.x, height: SIZE.y, depth_or_array_layers: 1 };
    let pixel = vec![gray; format.block_copy_size(None).expect("no depth format") as usize];
    Image::new_fill(size, TextureDimension::D2, &pixel, format, RenderAssetUsages::all())
}

#[test]
fn an_image_of_the_game_is_a_feed_that_follows_its_changes() {
    let mut app = player();
    app.add_plugins((AssetPlugin::default(), ImagePlugin::default()));
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(solid_image(50, TextureFormat::Rgba8UnormSrgb));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::image(image.clone()))).id();
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(50)));
    let pictures = statistics(&app, camera).frames;
    app.update();
    app.update();
    assert_eq!(statistics(&app, camera).frames, pictures, "an unchanged image is no new picture");
    let change = |app: &mut App, image: &Handle<Image>, to: Image| {
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        *images.get_mut(image).expect("exists") = to;
    };
    change(&mut app, &image, solid_image(90, TextureFormat::Rgba8Unorm));
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(90)));
    // A format that cannot be used is said; a usable one ends the trouble.
    change(&mut app, &image, solid_image(1, TextureFormat::Rgba16Float));
    assert!(update_until(&mut app, |app| matches!(state(app, camera), FeedState::Lost(_))));
    assert_eq!(gray(&app, camera), Some(90));
    change(&mut app, &image, solid_image(20, TextureFormat::Bgra8UnormSrgb));
    assert!(update_until(&mut app, |app| gray(app, camera) == Some(20)));
    assert_eq!(state(&app, camera), FeedState::Playing);
}

#[test]
fn what_another_camera_draws_is_a_feed() {
    let Some(mut app) = gpu::app(|app| {
        app.add_plugins(CameraPlugin);
    }) else {
        return;
    };
    let (drawn, target) = headless::add_target(&mut app, SIZE);
    let color = Color::srgb_u8(200, 100, 50);
    let clear = Camera { clear_color: ClearColorConfig::Custom(color), ..default() };
    app.world_mut().spawn((Camera3d::default(), bevy::core_pipeline::tonemapping::Tonemapping::None, clear, target));
    let (_, target): (_, RenderTarget) = headless::add_target(&mut app, SIZE);
    let camera = app.world_mut().spawn((ArCamera::default(), target, CameraFeed::image(drawn))).id();
    let picture = |app: &App| app.world().get::<CameraFrame>(camera).map(|frame| frame.pixels.rgb8(4, 4));
    let is_seen = update_until(&mut app, |app| picture(app) == Some([200, 100, 50]));
    assert!(is_seen, "{:?}, {:?}", picture(&app), state(&app, camera));
    assert!(statistics(&app, camera).frames > 1, "every frame is a new picture");
    // The reader goes with the feed.
    let pixels = FramePixels::new(SIZE, vec![9; 4 * 48]).expect("fits");
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(pixels));
    assert!(update_until(&mut app, |app| picture(app) == Some([9, 9, 9])));
    let pictures = statistics(&app, camera).frames;
    for _ in 0..5 {
        app.update();
    }
    assert_eq!(statistics(&app, camera).frames, pictures);
}

/// Closed until opened.
type Gate = Arc<(Mutex<bool>, Condvar)>;

/// A detector that finds nothing, but not before its gate is open.
struct Gated(Gate);

impl MarkerDetector for Gated {
    fn detect(&mut self, _picture: LumaView, _decimation: f32) -> Vec<DetectedMarker> {
        let (is_open, opened) = &*self.0;
        let guard = is_open.lock().expect("no test panicked");
        drop(opened.wait_while(guard, |is_open| !*is_open).expect("no test panicked"));
        Vec::new()
    }
}

#[test]
fn updates_do_not_wait_for_the_search_and_pictures_come_with_their_markers() {
    let gate = Gate::default();
    let mut app = player();
    app.insert_resource(MarkerDetection::new(Gated(gate.clone()))).add_plugins(TrackingPlugin);
    let camera = app.world_mut().spawn(ArCamera::default()).id();
    for brightness in [10, 20, 30, 40] {
        let pixels = FramePixels::new(SIZE, vec![brightness; 4 * 48]).expect("fits");
        app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(pixels));
        // Would never return if it waited for the detector.
        app.update();
        assert_eq!(gray(&app, camera), None, "a picture was shown before it was searched");
    }
    *gate.0.lock().expect("no test panicked") = true;
    gate.1.notify_all();
    let mut shown = Vec::new();
    let all_shown = update_until(&mut app, |app| {
        let frame = app.world().get::<CameraFrame>(camera).map(|frame| frame.sequence);
        let markers = app.world().get::<DetectedMarkers>(camera).map(|markers| markers.sequence);
        assert_eq!(frame, markers, "picture and markers belong together");
        shown.extend(frame.filter(|sequence| shown.last() != Some(sequence)));
        shown.last() == Some(&4)
    });
    assert!(all_shown);
    assert_eq!(shown, [1, 4], "the first was being searched, of the others the newest wins");
    assert_eq!(statistics(&app, camera).dropped, 2);
}
