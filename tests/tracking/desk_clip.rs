//! The shipped recording of a desk: every frame gives the true pose of the camera. Needs no GPU.

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::CameraPlugin,
    prelude::*,
    tracking::{MarkerDetection, MarkerState, MarkerTracking, TrackingPlugin},
};
use serde_json::Value;

const CLIP: &str = "assets/desk_clip";
/// Largest error of the rotation in degrees, and in half of the frames.
const DEGREES: (f32, f32) = (0.25, 0.1);
/// Largest error of the camera's position as a fraction of its distance from the marker, and in half of the frames.
const SHARE: (f32, f32) = (0.005, 0.0015);
const LOOPS: usize = 2;

fn vector(value: &Value) -> Vec3 {
    let number = |i: usize| value[i].as_f64().expect("the sidecar has numbers") as f32;
    Vec3::new(number(0), number(1), number(2))
}

#[test]
fn the_camera_is_found_in_every_picture_of_two_loops() {
    camera_is_found(None);
}

/// Plays two loops of the clip and compares the camera in each frame with the truth. With another detector than the one
/// that is built in, if there is one.
pub(crate) fn camera_is_found(detection: Option<MarkerDetection>) {
    let sidecar = std::fs::read_to_string(format!("{CLIP}/clip.json")).expect("shipped");
    let sidecar: Value = serde_json::from_str(&sidecar).expect("shipped");
    let truth: Vec<Transform> = sidecar["frames"]
        .as_array()
        .expect("the sidecar has the true cameras")
        .iter()
        .map(|frame| {
            let eye = vector(&frame["camera_origin"]);
            Transform::from_translation(eye).looking_at(vector(&frame["camera_target"]), Vec3::Y)
        })
        .collect();

    let mut app = App::new();
    if let Some(detection) = detection {
        app.insert_resource(detection);
    }
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin, TrackingPlugin));
    let feed = CameraFeed::clip(CLIP).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    // The print is 0.6 mm thick and lies on the desk, whose surface is the truth's zero.
    let anchor = (MarkerAnchor::new(0, 0.1), WorldOrigin, Transform::from_xyz(0.0, 0.0006, 0.0));
    let anchor = app.world_mut().spawn(anchor).id();
    let (mut all_degrees, mut all_shares) = (Vec::new(), Vec::new());
    for step in 0..LOOPS * truth.len() {
        app.update();
        let tracking = app.world().get::<MarkerTracking>(anchor).expect("comes with the anchor");
        assert_eq!(tracking.state, MarkerState::Tracked, "picture {step}");
        let expected = &truth[step % truth.len()];
        let found = app.world().get::<GlobalTransform>(camera).expect("is a camera").to_isometry();
        // `angle_between` takes the arc cosine, which cannot tell angles below 0.04° apart.
        let turn = found.rotation * expected.rotation.inverse();
        all_degrees.push((2.0 * turn.xyz().length()).to_degrees());
        let off = Vec3::from(found.translation).distance(expected.translation);
        all_shares.push(off / expected.translation.length());
    }
    let median_and_worst = |mut errors: Vec<f32>| {
        errors.sort_by(f32::total_cmp);
        (errors[errors.len() - 1], errors[errors.len() / 2])
    };
    let (degrees, share) = (median_and_worst(all_degrees), median_and_worst(all_shares));
    println!("worst and median: {degrees:?}° and {share:?} of the distance");
    assert!(degrees.0 <= DEGREES.0 && degrees.1 <= DEGREES.1, "{degrees:?}°");
    assert!(share.0 <= SHARE.0 && share.1 <= SHARE.1, "{share:?} of the distance");
}
