//! The shipped recording of a desk: every frame gives the true pose of the camera. Needs no GPU.

use bevy::prelude::*;
use bevy_mirrorball::{
    camera::CameraPlugin,
    prelude::*,
    tracking::{MarkerState, MarkerTracking, TrackingPlugin},
};
use serde_json::Value;

const CLIP: &str = "assets/desk_clip";
/// Maximum error of the rotation, in degrees.
const DEGREES: f32 = 0.5;
/// Maximum error of the camera's position, as a fraction of its distance from the marker.
const SHARE: f32 = 0.01;
const LOOPS: usize = 2;

fn vector(value: &Value) -> Vec3 {
    let number = |i: usize| value[i].as_f64().expect("the sidecar has numbers") as f32;
    Vec3::new(number(0), number(1), number(2))
}

#[test]
fn the_camera_is_found_in_every_picture_of_two_loops() {
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
    app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin, TrackingPlugin));
    let feed = CameraFeed::clip(CLIP).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::default(), feed)).id();
    // The print is 0.6 mm thick and lies on the desk, whose surface is the truth's zero.
    let anchor = (MarkerAnchor::new(0, 0.1), WorldOrigin, Transform::from_xyz(0.0, 0.0006, 0.0));
    let anchor = app.world_mut().spawn(anchor).id();
    let (mut worst_degrees, mut worst_share) = (0.0_f32, 0.0_f32);
    for step in 0..LOOPS * truth.len() {
        app.update();
        let tracking = app.world().get::<MarkerTracking>(anchor).expect("comes with the anchor");
        assert_eq!(tracking.state, MarkerState::Tracked, "picture {step}");
        let expected = &truth[step % truth.len()];
        let found = app.world().get::<GlobalTransform>(camera).expect("is a camera").to_isometry();
        let degrees = found.rotation.angle_between(expected.rotation).to_degrees();
        let share = Vec3::from(found.translation).distance(expected.translation) / expected.translation.length();
        assert!(degrees <= DEGREES && share <= SHARE, "picture {step}: {degrees}°, {share} of the distance");
        (worst_degrees, worst_share) = (worst_degrees.max(degrees), worst_share.max(share));
    }
    println!("worst of all pictures: {worst_degrees:.3}°, {:.3} % of the distance", 100.0 * worst_share);
}
