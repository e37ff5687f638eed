//! Frames and marker detection, which runs in the background.

use super::{SIZE, gray, player, statistics, update_until};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{DetectedMarker, DetectedMarkers, LumaView, MarkerDetection, MarkerDetector, TrackingPlugin},
};
use std::sync::{Arc, Condvar, Mutex};

/// Closed until opened.
pub(crate) type Gate = Arc<(Mutex<bool>, Condvar)>;

/// A detector that finds nothing, but not before its gate is open.
pub(crate) struct Gated(pub(crate) Gate);

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
