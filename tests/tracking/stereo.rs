//! Two cameras place a marker where both of them see it, in rendered frames.

use crate::{lens::LENS, rendered_marker::MarkerDesk};
use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    tracking::{MarkerFamily, MarkerId, MarkerTracking, TrackingPlugin, marker_cells},
};
use std::time::Duration;

const SIZE: f32 = 0.1;
/// Number of places of the marker.
const PLACES: u32 = 12;

fn eye(side: f32) -> Transform {
    Transform::from_xyz(side * 0.7, 1.0, 0.5).looking_at(Vec3::new(0.0, 0.1, 0.0), Vec3::Y)
}

/// Largest and mean distance in meters of the anchor from where the marker is, with these of the two cameras.
fn errors(sides: &[f32]) -> (f32, f32) {
    let marker = MarkerId { family: MarkerFamily::Tag36h11, id: 7 };
    let desk = MarkerDesk::new(LENS, marker_cells(marker).expect("in the family"), SIZE);
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, TrackingPlugin));
    let camera = |order, side| (ArCamera::new(LENS), Camera { order, ..default() }, eye(side));
    let cameras: Vec<_> =
        sides.iter().zip(0..).map(|(side, order)| app.world_mut().spawn(camera(order, *side)).id()).collect();
    let anchor = app.world_mut().spawn(MarkerAnchor::new(7, SIZE)).id();
    let distances = (0..PLACES).map(|i| {
        let angle = i as f32;
        let place = Vec3::new(0.25 * angle.sin(), 0.1 + 0.1 * (2.0 * angle).sin(), 0.25 * (1.7 * angle).cos());
        let world_from_marker = Isometry3d::new(place, Quat::from_rotation_y(0.4 * angle));
        for (camera, side) in cameras.iter().zip(sides) {
            let pixels = desk.frame(eye(*side).to_isometry().inverse() * world_from_marker, u64::from(2 * i) + 1);
            let captured = Duration::from_millis(33 * u64::from(i) + 9 * u64::from(*side > 0.0));
            app.world_mut().entity_mut(*camera).insert(CameraFrame::new(pixels, u64::from(i) + 1, captured));
        }
        app.update();
        let tracking = app.world().get::<MarkerTracking>(anchor).expect("an anchor");
        assert_eq!(tracking.last_seen, Some(u64::from(i) + 1), "marker not found at {place}");
        app.world().get::<GlobalTransform>(anchor).expect("an anchor").translation().distance(place)
    });
    let distances: Vec<f32> = distances.collect();
    (distances.iter().copied().fold(0.0, f32::max), distances.iter().sum::<f32>() / distances.len() as f32)
}

#[test]
fn two_cameras_know_better_than_one_where_a_marker_is() {
    let alone = [errors(&[-1.0]), errors(&[1.0])];
    let (worst, mean) = errors(&[-1.0, 1.0]);
    println!("stereo: alone {alone:?}, together worst {worst}, mean {mean}");
    assert!(worst < 0.001, "{worst} {alone:?}");
    let best_mean = alone[0].1.min(alone[1].1);
    assert!(mean < 0.1 * best_mean, "{mean} {alone:?}");
}
