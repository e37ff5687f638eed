//! Markers of several families: each anchor follows its own, and only the families of anchors are searched for.

use crate::{
    lens::LENS,
    scripted_desk::{Desk, SIZE, first_view, second_view, seen},
};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{
        DetectedMarker, LumaView, MarkerDetection, MarkerDetector, MarkerFamily, MarkerState, TrackingError,
        TrackingPlugin,
    },
};
use std::sync::{Arc, Mutex};

#[test]
fn a_number_of_another_family_is_another_marker() {
    let mut desk = Desk::new();
    let anchor = desk.spawn(MarkerAnchor::new(7, SIZE));
    let other = desk.spawn(MarkerAnchor::new(7, SIZE).with_family(MarkerFamily::Tag25h9));
    let seen_other = DetectedMarker { family: MarkerFamily::Tag25h9, ..seen(7, second_view()) };
    desk.show(std::slice::from_ref(&seen_other));
    assert_eq!(desk.tracking(anchor).state, MarkerState::Searching);
    desk.assert_camera_from(other, second_view());
    desk.show(&[seen(7, first_view()), seen_other]);
    desk.assert_camera_from(anchor, first_view());
    desk.assert_camera_from(other, second_view());
    assert_eq!((desk.tracking(anchor).copies, desk.tracking(other).copies), (1, 1));
}

/// Detector that sees nothing and notes the families it is asked for.
struct Noting(Arc<Mutex<Vec<MarkerFamily>>>);

impl MarkerDetector for Noting {
    fn set_families(&mut self, families: &[MarkerFamily]) -> Result<(), TrackingError> {
        *self.0.lock().expect("no test panicked") = families.to_vec();
        Ok(())
    }

    fn detect(&mut self, _: LumaView, _: f32) -> Vec<DetectedMarker> {
        Vec::new()
    }
}

#[test]
fn the_families_of_the_anchors_are_searched_for() {
    let noted = Arc::new(Mutex::new(Vec::new()));
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin))
        .insert_resource(MarkerDetection::new(Noting(noted.clone())))
        .add_plugins(TrackingPlugin);
    let camera = app.world_mut().spawn(ArCamera::new(LENS)).id();
    let searched = |app: &mut App, sequence| {
        let pixels = FramePixels::new(UVec2::ONE, vec![128; 4]).expect("as many bytes as the size says");
        app.world_mut().entity_mut(camera).insert(CameraFrame::new(pixels, sequence, default()));
        app.update();
        noted.lock().expect("no test panicked").clone()
    };
    assert_eq!(searched(&mut app, 1), [MarkerFamily::Tag36h11], "without anchors");
    for (family, id) in [(MarkerFamily::TagCircle21h7, 1), (MarkerFamily::Tag25h9, 2), (MarkerFamily::TagCircle21h7, 3)]
    {
        app.world_mut().spawn(MarkerAnchor::new(id, SIZE).with_family(family));
    }
    // No such number: this anchor is not valid and costs nothing.
    app.world_mut().spawn(MarkerAnchor::new(30, SIZE).with_family(MarkerFamily::Tag16h5));
    assert_eq!(searched(&mut app, 2), [MarkerFamily::Tag25h9, MarkerFamily::TagCircle21h7]);
}
