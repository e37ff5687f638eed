//! The checklist and the diagnostics on the photograph of a real desk, and when something is missing.

use crate::gpu;
use bevy::{
    diagnostic::{DiagnosticPath, DiagnosticsStore},
    ecs::system::RunSystemOnce,
    prelude::*,
};
use bevy_mirrorball::{
    camera::{CameraPlugin, Distortion, FramePixels},
    debug::{
        CAPTURE_RATE, Check, CheckLevel, Checklist, DECODE, DETECT, DROPPED, LIGHTING_AGE, MEASURE,
        MirrorballDiagnosticsPlugin,
    },
    prelude::*,
    probe::ProbePlugin,
    tracking::{PoseFilter, TrackingPlugin},
};
use std::time::Duration;

const PHOTO: &str = "assets/desk/photo.jpg";
const INTRINSICS: Intrinsics =
    Intrinsics::new(Vec2::new(601.83, 601.83), Vec2::new(320.0, 240.0), UVec2::new(640, 480));

/// What measures without drawing.
fn measuring() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), ImagePlugin::default(), TransformPlugin))
        .init_asset::<Shader>()
        .add_plugins((CameraPlugin, TrackingPlugin, ProbePlugin, MirrorballDiagnosticsPlugin));
    app
}

fn checks(app: &mut App) -> Vec<Check> {
    app.world_mut().run_system_once(|checklist: Checklist| checklist.checks()).expect("all parameters exist")
}

/// The only line about a topic.
fn check(app: &mut App, topic: &str) -> (CheckLevel, String) {
    let mut lines: Vec<_> = checks(app).into_iter().filter(|check| check.topic == topic).collect();
    let line = lines.pop().unwrap_or_else(|| panic!("a line about {topic}"));
    assert_eq!(lines, [], "one line about {topic}");
    (line.level, line.text)
}

fn expect(app: &mut App, topic: &str, level: CheckLevel, part: &str) {
    let (found, text) = check(app, topic);
    assert!(found == level && text.contains(part), "{topic} is {found:?}: {text}");
}

fn newest(app: &App, path: &DiagnosticPath) -> Option<f64> {
    app.world().resource::<DiagnosticsStore>().get(path).expect("registered").value()
}

fn photo() -> CameraFeed {
    CameraFeed::file(PHOTO).with_pace(FeedPace::Lockstep)
}

#[test]
fn the_checklist_leads_from_nothing_to_measured_light() {
    use CheckLevel::{Good, Missing, Warning};
    let mut app = measuring();
    app.update();
    expect(&mut app, "camera", Missing, "ArCamera");

    let camera = app.world_mut().spawn(ArCamera::default()).id();
    app.update();
    expect(&mut app, "feed", Missing, "no CameraFeed");
    app.world_mut().entity_mut(camera).insert(CameraFeed::clip("nowhere").with_pace(FeedPace::Lockstep));
    app.update();
    expect(&mut app, "feed", Missing, "clip.json");
    app.world_mut().entity_mut(camera).insert(photo());
    app.update();
    expect(&mut app, "feed", Good, "640 × 480");
    expect(&mut app, "lens", Warning, "never calibrated, a field of view of 60°");
    let wide = Intrinsics::new(INTRINSICS.focal, Vec2::new(320.0, 180.0), UVec2::new(640, 360));
    app.world_mut().entity_mut(camera).insert(ArCamera::new(wide));
    expect(&mut app, "lens", Warning, "another shape; calibrate");
    let distortion = Distortion { k1: -0.1, ..Distortion::NONE };
    app.world_mut().entity_mut(camera).insert(ArCamera::new(Intrinsics { distortion, ..INTRINSICS }));
    expect(&mut app, "lens", Good, "calibrated, frames are undistorted");
    let of_twice_the_size = Intrinsics { center: INTRINSICS.center * 2.0, ..INTRINSICS };
    app.world_mut().entity_mut(camera).insert(ArCamera::new(of_twice_the_size));
    expect(&mut app, "lens", Warning, "those of 1280 × 960");
    app.world_mut().entity_mut(camera).insert(ArCamera::new(INTRINSICS));
    expect(&mut app, "lens", Good, "known");

    expect(&mut app, "marker", Warning, "no MarkerAnchor");
    expect(&mut app, "ball", Warning, "no LightProbeSphere");
    expect(&mut app, "shadows", Warning, "no ShadowDomeLight");
    app.world_mut().spawn(ShadowDomeLight::default());
    assert!(checks(&mut app).iter().all(|check| check.topic != "shadows"), "good shadows need no line");

    let anchor = app.world_mut().spawn((MarkerAnchor::new(0, 0.1), WorldOrigin)).id();
    let other = app.world_mut().spawn(MarkerAnchor::new(5, 0.1)).id();
    app.world_mut().entity_mut(camera).insert(photo());
    app.update();
    let (_, searching) = (check_of(&mut app, "number 0", Good), check_of(&mut app, "number 5", Missing));
    assert!(searching.contains("not seen yet"), "{searching}");
    app.world_mut().despawn(other);

    let ball = app
        .world_mut()
        .spawn((LightProbeSphere::default(), ChildOf(anchor), Transform::from_xyz(0.17, 0.05, 0.01)))
        .id();
    app.world_mut().entity_mut(camera).insert(photo());
    app.update();
    expect(&mut app, "ball", Good, "px wide");
    expect(&mut app, "exposure", Good, "% of the ball clipped");

    // The same desk through a camera that is set too bright.
    let original = FramePixels::open(PHOTO).expect("shipped");
    let brighter = |value: &u8| value.saturating_mul(3);
    let bright = FramePixels::new(original.size, original.rgba.iter().map(brighter).collect()).expect("as large");
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(bright).with_pace(FeedPace::Lockstep));
    app.update();
    expect(&mut app, "exposure", Warning, "lower the camera's exposure");

    let dark = FramePixels::new(UVec2::new(640, 480), vec![0; 640 * 480 * 4]).expect("fits");
    app.world_mut().get_mut::<Transform>(ball).expect("has one").translation.y = 5.0;
    let dark = CameraFeed::pixels(dark).with_pace(FeedPace::Lockstep);
    app.world_mut().entity_mut(camera).insert(dark.clone());
    app.update();
    expect(&mut app, "marker", Good, "out of view for a moment");
    app.world_mut().entity_mut(anchor).insert(PoseFilter { lost_after: Duration::ZERO, ..default() });
    app.world_mut().entity_mut(camera).insert(dark);
    app.update();
    expect(&mut app, "marker", Missing, "is lost, its last pose stays");
    expect(&mut app, "ball", Missing, "the last light stays");
}

/// The text of the only line that has `part`, which has to be of this level.
fn check_of(app: &mut App, part: &str, level: CheckLevel) -> String {
    let mut lines = checks(app).into_iter().filter(|check| check.text.contains(part));
    let line = lines.next().unwrap_or_else(|| panic!("a line with {part}"));
    assert_eq!((line.level, lines.next()), (level, None), "{}", line.text);
    line.text
}

#[test]
fn each_stage_reports_its_time_once_a_picture() {
    let mut app = measuring();
    let feed = CameraFeed::clip("assets/desk_clip").with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((ArCamera::default(), feed));
    app.world_mut().spawn((MarkerAnchor::new(0, 0.1), WorldOrigin));
    app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.17, 0.05, 0.01)));
    for _ in 0..4 {
        app.update();
    }
    assert_eq!(newest(&app, &CAPTURE_RATE).map(f64::round), Some(15.0), "the clip's sidecar says so");
    assert_eq!(newest(&app, &DROPPED), Some(0.0));
    for path in [DECODE, DETECT, MEASURE] {
        let milliseconds = newest(&app, &path).unwrap_or_else(|| panic!("{path} was measured"));
        assert!(milliseconds > 0.0, "{path}: {milliseconds}");
        let count = app.world().resource::<DiagnosticsStore>().get(&path).map(|diagnostic| diagnostic.values().count());
        assert!(count.is_some_and(|count| count <= 4), "{path}: {count:?} values of 4 pictures");
    }
    assert_eq!(newest(&app, &LIGHTING_AGE), None, "in lockstep pictures have the time of their recording");
}

#[test]
fn the_lighting_age_is_the_time_since_the_capture() {
    let Some(mut app) = gpu::app(|app| {
        app.add_plugins(MirrorballPlugins);
    }) else {
        return;
    };
    let (_, target) = bevy_mirrorball::headless::add_target(&mut app, UVec2::new(16, 12));
    let camera = app.world_mut().spawn((ArCamera::default(), target)).id();
    let gray = || CameraFeed::pixels(FramePixels::new(UVec2::new(8, 6), vec![90; 8 * 6 * 4]).expect("fits"));
    let mut ages = 0;
    for _ in 0..50 {
        app.world_mut().entity_mut(camera).insert(gray());
        app.update();
        // Between capture and the end of the frame.
        std::thread::sleep(Duration::from_millis(2));
        let elapsed = 1e3 * app.world().resource::<Time<Real>>().startup().elapsed().as_secs_f64();
        let store = app.world().resource::<DiagnosticsStore>();
        let values: Vec<f64> = store.get(&LIGHTING_AGE).expect("registered").values().copied().collect();
        assert!(values.iter().all(|age| *age > 0.0 && *age <= elapsed), "{values:?} after {elapsed} ms");
        ages = values.len();
    }
    assert!(ages > 10, "{ages} ages of 50 pictures");
}
