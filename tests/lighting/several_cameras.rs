//! Which of several cameras measures a ball, in whose units each of them is lit, and where a camera is whose parents
//! are scaled.

use crate::{cubes, gpu, probe, sphere::sphere};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    headless,
    prefilter::PrefilterPlugin,
    prelude::*,
    probe::{ProbeMeasurement, ProbePlugin},
    tracking::{MarkerState, MarkerTracking},
    unwrap::UnwrapPlugin,
};
use std::time::Duration;

const SIZE: UVec2 = UVec2::new(160, 120);
const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(150.0), Vec2::new(80.0, 60.0), SIZE);
const BALL: Vec3 = Vec3::new(0.1, 0.05, 0.0);

struct Desk {
    app: App,
    ball: Entity,
}

impl Desk {
    fn new() -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, AssetPlugin::default(), ImagePlugin::default(), TransformPlugin))
            .init_asset::<Shader>()
            .add_plugins((CameraPlugin, ProbePlugin));
        let ball = app.world_mut().spawn((LightProbeSphere::default(), Transform::from_translation(BALL))).id();
        Self { app, ball }
    }

    fn camera(&mut self, order: isize, place: Transform) -> Entity {
        let camera = (ArCamera::new(INTRINSICS), Camera { order, ..default() }, place, frame(1));
        self.app.world_mut().spawn(camera).id()
    }

    fn measurement(&mut self) -> ProbeMeasurement {
        self.app.update();
        self.app.world().get::<ProbeMeasurement>(self.ball).expect("a required component").clone()
    }

    fn look_away(&mut self, camera: Entity) {
        *self.app.world_mut().get_mut::<Transform>(camera).expect("it is somewhere") = looking_up();
    }
}

fn frame(sequence: u64) -> CameraFrame {
    let pixels = FramePixels::new(SIZE, vec![128; 4 * SIZE.element_product() as usize]).expect("fits");
    CameraFrame::new(pixels, sequence, Duration::from_millis(40 * sequence))
}

fn looking_at_the_ball(eye: Vec3) -> Transform {
    Transform::from_translation(eye).looking_at(BALL, Vec3::Y)
}

fn looking_up() -> Transform {
    Transform::from_xyz(0.0, 0.4, 0.3).looking_to(Vec3::Y, Vec3::NEG_Z)
}

#[test]
fn a_ball_is_measured_by_a_camera_that_has_it_in_view_and_stays_with_it() {
    let mut desk = Desk::new();
    let first = desk.camera(0, looking_up());
    let second = desk.camera(1, looking_at_the_ball(Vec3::new(0.0, 0.4, 0.3)));
    let third = desk.camera(2, looking_at_the_ball(Vec3::new(0.2, 0.3, 0.3)));
    let measured = desk.measurement();
    assert!(measured.is_in_view && measured.camera() == Some(second), "{measured:?}");
    // The first sees it now too; the light does not change over while the second still does.
    *desk.app.world_mut().get_mut::<Transform>(first).expect("it is somewhere") =
        looking_at_the_ball(Vec3::new(0.1, 0.4, 0.3));
    assert_eq!(desk.measurement().camera(), Some(second));
    desk.look_away(second);
    assert_eq!(desk.measurement().camera(), Some(first));
    desk.app.world_mut().despawn(first);
    let measured = desk.measurement();
    assert!(measured.is_in_view && measured.camera() == Some(third), "{measured:?}");
    desk.look_away(third);
    assert!(!desk.measurement().is_in_view);
}

#[test]
fn a_camera_that_knows_where_it_is_measures_rather_than_one_that_does_not() {
    let mut desk = Desk::new();
    let unposed = desk.camera(0, looking_at_the_ball(Vec3::new(0.1, 0.4, 0.3)));
    let posed = desk.camera(1, looking_at_the_ball(Vec3::new(0.0, 0.4, 0.3)));
    let tracking = MarkerTracking {
        state: MarkerState::Tracked,
        camera_from_marker: Some(Isometry3d::from_xyz(0.0, 0.0, -0.5)),
        last_seen: Some(1),
        camera: Some(posed),
        ..default()
    };
    desk.app.world_mut().spawn((MarkerAnchor::new(0, 0.1), tracking));
    let measured = desk.measurement();
    assert_eq!(measured.camera(), Some(posed), "not by {unposed}");
    assert!(measured.paper.is_some(), "the marker counts in the frames in which it was detected");
}

#[test]
fn a_ball_looks_the_same_to_a_camera_below_a_scaled_parent() {
    let eye = looking_at_the_ball(Vec3::new(0.05, 0.4, 0.3));
    let mut desk = Desk::new();
    desk.camera(0, eye);
    let expected = desk.measurement();
    assert!(expected.is_in_view);
    for scale in [0.01, 2.0] {
        let mut desk = Desk::new();
        let camera = desk.camera(0, Transform { translation: eye.translation / scale, ..eye });
        desk.app.world_mut().spawn(Transform::from_scale(Vec3::splat(scale))).add_child(camera);
        let measured = desk.measurement();
        assert!(measured.is_in_view, "scale {scale}");
        let (found, wanted) = (measured.outline, expected.outline);
        assert!(found.center.distance(wanted.center) < 1e-2, "scale {scale}: {found:?} instead of {wanted:?}");
        assert!(found.semi_axes.distance(wanted.semi_axes) < 1e-2, "scale {scale}: {found:?} instead of {wanted:?}");
    }
}

/// Half of the light of [`probe::smooth`]: what a camera with half the exposure shows.
fn half_as_bright(dir: Vec3) -> Vec3 {
    0.5 * probe::smooth(dir)
}

/// A step of 8-bit sRGB in the darkest parts, and the ball's rim.
const MEAN_TOLERANCE: f32 = 0.03;

#[test]
fn each_camera_is_lit_in_the_units_of_its_own_frames() {
    let Some(mut app) = gpu::app(|app| {
        app.add_plugins((CameraPlugin, ProbePlugin, UnwrapPlugin, PrefilterPlugin));
    }) else {
        return;
    };
    let rooms: [fn(Vec3) -> Vec3; 2] = [probe::smooth, half_as_bright];
    let cameras = [0, 1].map(|i| {
        let feed = CameraFeed::pixels(probe::photograph(rooms[i])).with_pace(FeedPace::Lockstep);
        let (_, target) = headless::add_target(&mut app, UVec2::splat(16));
        let camera = Camera { order: i as isize, ..default() };
        app.world_mut().spawn((ArCamera::new(probe::INTRINSICS), probe::camera_pose(), camera, feed, target)).id()
    });
    let ball = LightProbeSphere { radius: probe::RADIUS, reflectance: probe::REFLECTANCE, ..default() };
    app.world_mut().spawn((ball, Transform::from_translation(probe::BALL)));
    headless::settle(&mut app).expect("all shaders compile");
    for _ in 0..8 {
        app.update();
    }
    let towards_camera = probe::camera_pose().rotation * Vec3::Z;
    for (camera, room) in cameras.into_iter().zip(rooms) {
        let source = app.world().get::<LiveEnvironment>(camera).expect("every AR camera is lit").source.clone();
        let cube = cubes::read(&mut app, &source);
        let dirs = || sphere(2000).filter(|dir| towards_camera.dot(*dir) > -0.5);
        let error = |dir: Vec3| ((cube.sample(dir) - room(dir)) / room(dir)).abs().element_sum() / 3.0;
        let mean = dirs().map(error).sum::<f32>() / dirs().count() as f32;
        println!("camera {camera}: off by {:.2} %", 1e2 * mean);
        assert!(mean < MEAN_TOLERANCE);
    }
}
