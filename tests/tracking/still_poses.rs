//! Poses of live feeds stand still when nothing moves, and keep up when something does.

use crate::rendered_marker::MarkerDesk;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{FilterUse, MarkerTracking, PoseFilter, TrackingPlugin, marker_cells},
};
use std::time::Duration;

const SIZE: f32 = 0.1;
/// Frames per second.
const RATE: f64 = 30.0;
const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(600.0), Vec2::new(320.0, 240.0), UVec2::new(640, 480));

/// An app that sees the frames of a live feed.
struct Viewer {
    app: App,
    camera: Entity,
    anchor: Entity,
    frames: u64,
}

impl Viewer {
    fn new() -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, TrackingPlugin));
        let camera = app.world_mut().spawn(ArCamera::new(INTRINSICS)).id();
        // Frames that a game inserts are not live by themselves.
        let filter = PoseFilter { filter: FilterUse::Always, ..default() };
        let anchor = app.world_mut().spawn((MarkerAnchor::new(0, SIZE), filter)).id();
        Self { app, camera, anchor, frames: 0 }
    }

    fn show(&mut self, pixels: FramePixels) -> MarkerTracking {
        let captured = Duration::from_secs_f64(self.frames as f64 / RATE);
        self.frames += 1;
        self.app.world_mut().entity_mut(self.camera).insert(CameraFrame::new(pixels, self.frames, captured));
        self.app.update();
        self.app.world().get::<MarkerTracking>(self.anchor).expect("comes with the anchor").clone()
    }
}

fn desk() -> MarkerDesk {
    MarkerDesk::new(INTRINSICS, marker_cells(0).expect("tag36h11 has it"), SIZE)
}

/// A marker on a desk 0.6 m away, seen from a direction.
fn view(degrees: f32) -> Isometry3d {
    let eye = Quat::from_rotation_y(degrees.to_radians()) * Vec3::new(0.0, 0.45, 0.4);
    Transform::from_translation(eye).looking_at(Vec3::new(0.03, 0.0, 0.02), Vec3::Y).to_isometry().inverse()
}

fn degrees_between(a: Isometry3d, b: Isometry3d) -> f32 {
    // `angle_between` takes the arc cosine, which cannot tell angles below 0.04° apart.
    (2.0 * (a.rotation * b.rotation.inverse()).xyz().length()).to_degrees()
}

fn pose(tracking: &MarkerTracking) -> Isometry3d {
    tracking.camera_from_marker.expect("tracked")
}

#[test]
fn noise_hardly_moves_a_marker_that_stands_still() {
    let (desk, mut viewer) = (desk(), Viewer::new());
    let shown: Vec<_> = (0..60).map(|seed| viewer.show(desk.frame(view(20.0), seed))).collect();
    let last: Vec<_> = shown[20..].iter().map(pose).collect();
    let count = last.len() as f32;
    let mean = last.iter().map(|pose| Vec3::from(pose.translation)).sum::<Vec3>() / count;
    let first = last[0];
    let turns: Vec<Vec3> = last.iter().map(|pose| (pose.rotation * first.rotation.inverse()).xyz() * 2.0).collect();
    let mean_turn = turns.iter().sum::<Vec3>() / count;
    let root = |squares: f32| (squares / count).sqrt();
    let degrees = root(turns.iter().map(|turn| turn.distance_squared(mean_turn)).sum()).to_degrees();
    let share = root(last.iter().map(|pose| Vec3::from(pose.translation).distance_squared(mean)).sum()) / mean.length();
    println!("standard deviation: {degrees:.4}° and {:.4} % of the distance", 100.0 * share);
    assert!(degrees <= 0.05 && share <= 0.001, "{degrees}°, {share} of the distance");
    assert!(shown[59].is_steady() && !shown[2].is_steady());
}

#[test]
fn a_step_of_ten_degrees_is_followed_within_two_frames() {
    let (desk, mut viewer) = (desk(), Viewer::new());
    for seed in 0..20 {
        viewer.show(desk.frame(view(0.0), seed));
    }
    viewer.show(desk.frame(view(10.0), 20));
    let tracking = viewer.show(desk.frame(view(10.0), 21));
    let left = degrees_between(pose(&tracking), view(10.0));
    assert!(left <= 1.0, "{left}° of 10° are left");
    assert!(!tracking.is_steady());
}

#[test]
fn a_steady_pan_lags_by_less_than_a_frame() {
    let (desk, mut viewer) = (desk(), Viewer::new());
    let speed = 15.0;
    let at = |frame: u64| view(speed * frame as f32 / RATE as f32);
    let shown: Vec<_> = (0..40).map(|frame| viewer.show(desk.frame(at(frame), frame))).collect();
    let lag = |frame: u64| degrees_between(pose(&shown[frame as usize]), at(frame)) * RATE as f32 / speed;
    let worst = (30..40).map(lag).fold(0.0, f32::max);
    println!("lag of {worst:.2} frames");
    assert!(worst < 1.0, "{worst} frames");
}
