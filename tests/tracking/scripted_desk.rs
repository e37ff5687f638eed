//! A desk whose markers are where the test says: the detector says what it is told. Needs neither a GPU nor the
//! AprilTag library.

use crate::lens::LENS;
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::FramePixels,
    prelude::*,
    tracking::{
        DetectedMarker, LumaView, MarkerDetection, MarkerDetector, MarkerFamily, MarkerTracking, TrackingPlugin,
    },
};
use std::{
    sync::{Arc, Mutex},
    time::Duration,
};

/// Side of the markers in meters.
pub(crate) const SIZE: f32 = 0.1;
/// Rotations pass through a handful of products in single precision.
const RADIANS: f32 = 1e-5;
/// The same for positions a few meters from the world's origin.
const METERS: f32 = 1e-5;

/// Markers that say so are found at full resolution only.
pub(crate) const HARD_TO_READ: u32 = 2;

pub(crate) type Script = Arc<Mutex<Vec<DetectedMarker>>>;

struct Scripted(Script);

impl MarkerDetector for Scripted {
    fn detect(&mut self, picture: LumaView, decimation: f32) -> Vec<DetectedMarker> {
        // The window around a marker is searched again; corners found there count from the window's corner.
        if picture.size() != LENS.size {
            return Vec::new();
        }
        let mut markers = self.0.lock().expect("no test panicked").clone();
        markers.retain(|marker| decimation <= 1.0 || marker.corrected_bits != HARD_TO_READ);
        markers
    }
}

/// How a marker of [`SIZE`] looks from a camera.
pub(crate) fn seen(id: u32, camera_from_marker: Isometry3d) -> DetectedMarker {
    let h = 0.5 * SIZE;
    let (focal, center) = (LENS.focal.as_dvec2(), LENS.center.as_dvec2());
    let corners = [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, z)| {
        let p = Vec3::from(camera_from_marker.transform_point(Vec3::new(x, 0.0, z))).as_dvec3();
        center + focal * DVec2::new(p.x, -p.y) / -p.z
    });
    DetectedMarker { family: MarkerFamily::Tag36h11, id, corners, corrected_bits: 0 }
}

/// Pose of the marker for a camera at a point of the marker frame that looks at the marker.
pub(crate) fn view_from(eye: Vec3) -> Isometry3d {
    Transform::from_translation(eye).looking_at(Vec3::new(0.01, 0.0, 0.02), Vec3::Y).to_isometry().inverse()
}

pub(crate) fn first_view() -> Isometry3d {
    view_from(Vec3::new(0.1, 0.4, 0.3))
}

pub(crate) fn second_view() -> Isometry3d {
    view_from(Vec3::new(-0.3, 0.35, 0.2))
}

/// An app with tracking and one camera.
pub(crate) struct Desk {
    pub(crate) app: App,
    pub(crate) camera: Entity,
    pub(crate) script: Script,
    pub(crate) sequence: u64,
}

impl Desk {
    pub(crate) fn new() -> Self {
        let (mut app, script) = (App::new(), Script::default());
        app.add_plugins((MinimalPlugins, TransformPlugin))
            .insert_resource(MarkerDetection::new(Scripted(script.clone())))
            .add_plugins(TrackingPlugin);
        let start = Transform::from_xyz(3.0, 2.0, 1.0).with_rotation(Quat::from_euler(EulerRot::YXZ, 0.5, -0.4, 0.3));
        let camera = app.world_mut().spawn((ArCamera::new(LENS), start)).id();
        Self { app, camera, script, sequence: 0 }
    }

    pub(crate) fn spawn(&mut self, bundle: impl Bundle) -> Entity {
        self.app.world_mut().spawn(bundle).id()
    }

    /// A new picture arrives, with these markers in it.
    pub(crate) fn show(&mut self, markers: &[DetectedMarker]) {
        self.show_to(self.camera, markers);
    }

    /// A new picture arrives at a camera, with these markers in it.
    pub(crate) fn show_to(&mut self, camera: Entity, markers: &[DetectedMarker]) {
        let pixels = FramePixels::new(LENS.size, vec![128; 4 * LENS.size.element_product() as usize]).expect("fits");
        self.show_pixels_to(camera, markers, pixels);
    }

    /// The same with a picture of the test.
    pub(crate) fn show_pixels_to(&mut self, camera: Entity, markers: &[DetectedMarker], pixels: FramePixels) {
        *self.script.lock().expect("no test panicked") = markers.to_vec();
        self.sequence += 1;
        let captured = Duration::from_millis(40 * self.sequence);
        let frame = CameraFrame::new(pixels, self.sequence, captured);
        self.app.world_mut().entity_mut(camera).insert(frame);
        self.app.update();
    }

    pub(crate) fn get<C: Component + Clone>(&self, entity: Entity) -> C {
        self.app.world().get::<C>(entity).expect("the component").clone()
    }

    pub(crate) fn world_from(&self, entity: Entity) -> Isometry3d {
        self.get::<GlobalTransform>(entity).to_isometry()
    }

    /// Where the scene has the marker, seen from the camera.
    pub(crate) fn assert_camera_from(&self, anchor: Entity, expected: Isometry3d) {
        assert_same(self.world_from(self.camera).inverse() * self.world_from(anchor), expected);
    }

    pub(crate) fn tracking(&self, anchor: Entity) -> MarkerTracking {
        self.get(anchor)
    }
}

pub(crate) fn assert_same(found: Isometry3d, expected: Isometry3d) {
    // `angle_between` takes the arc cosine, which cannot tell angles below 0.001 rad from none.
    let turn = 2.0 * (found.rotation * expected.rotation.inverse()).xyz().length();
    let shift = found.translation.distance(expected.translation);
    println!("off by {turn} rad and {shift} m");
    assert!(turn < RADIANS && shift < METERS, "{found:?} instead of {expected:?}: {turn} rad, {shift} m");
}
