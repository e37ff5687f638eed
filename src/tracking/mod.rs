//! Frame → marker poses → camera pose or anchor transforms.
//!
//! **Enters:** the camera's newest picture and intrinsics, [`MarkerAnchor`]s. **Leaves:** [`DetectedMarkers`] on the camera,
//! a [`MarkerTracking`] on each anchor, and moved [`Transform`]s.
//!
//! # Frames
//! The marker frame has its origin at the center of the black square, +X to the right, +Y out of the paper and +Z to the
//! bottom edge of the marker, upright *as the AprilTag project prints it* (OpenCV's dictionary prints it turned by 180°). A
//! marker lying on the desk has +Y up like the world. `camera_from_marker` is in Bevy's camera axes.
//!
//! # Who moves
//! With [`WorldOrigin`] on one anchor, that anchor stays where the game put it and the camera moves. Without it the camera
//! stays and the anchors move.
//!
//! # Lost markers
//! A lost marker is a state: [`MarkerTracking::state`] says so, everything stays where it was last, and the next sight of the
//! marker takes over.
//!
//! # Cost
//! With the AprilTag library about 8 ms of CPU for a 640 × 480 picture and 30 ms for 1280 × 720; four times that when a
//! wanted marker is not found at half resolution.

#[cfg(feature = "apriltag")]
mod apriltag;
mod detect_markers;
mod detection;
mod detector;
mod pose;
#[cfg(feature = "apriltag")]
mod print;
mod track;

#[cfg(feature = "apriltag")]
pub use apriltag::AprilTagDetector;
pub use detect_markers::detect_markers;
pub use detection::MarkerDetection;
pub use detector::{DetectedMarker, LumaView, MarkerDetector};
/// Old name of [`detect_markers`](fn@detect_markers).
#[deprecated(since = "0.1.0", note = "use `detect_markers`")]
#[doc(hidden)]
pub fn find_markers(detector: &mut dyn MarkerDetector, frame: &FramePixels, wanted: &[u32]) -> Vec<DetectedMarker> {
    detect_markers(detector, frame, wanted)
}

pub use pose::{MarkerPose, PoseCandidates};
#[cfg(feature = "apriltag")]
pub use print::marker_sheet_svg;

use crate::{
    MirrorballSystems,
    camera::{FramePixels, FramesAwaitTracking},
};
use bevy::prelude::*;
use std::time::Duration;

/// What can go wrong in tracking. A marker that is not in view is no error.
#[derive(thiserror::Error, Debug, PartialEq)]
pub enum TrackingError {
    /// The crate was built without a detector and the game has inserted none.
    #[error("no marker detector: enable the feature `apriltag` or insert the resource MarkerDetection")]
    NoDetector,
    /// The AprilTag library linked is not the one whose memory layout we know.
    #[error(
        "the linked AprilTag library is not version 3.4.5: set the environment variable APRILTAG_SYS_METHOD=raw,static \
         when building, so that the version that comes with the crate apriltag-sys is compiled"
    )]
    WrongLibrary,
    /// The AprilTag library could not allocate.
    #[error("the AprilTag library is out of memory")]
    OutOfMemory,
    /// There is no such marker.
    #[error("tag36h11 has no marker number {0}; numbers go from 0 to 586")]
    NoSuchMarker(u32),
    /// A size that is not a length.
    #[error("a marker cannot be {0} meters wide; give the side of its black square, above 0")]
    BadSize(f32),
}

/// A printed square marker of the family tag36h11; the entity's frame is the marker's frame.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// // Marker 0, black square 10 cm wide, is the origin of the world; the camera moves around it.
/// commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
/// // Marker 7 is glued to a box that is pushed about.
/// commands.spawn(MarkerAnchor::new(7, 0.04));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, MarkerTracking)]
pub struct MarkerAnchor {
    /// Number of the marker in its family (tag36h11: 0…586).
    pub id: u32,
    /// Side of the printed black square in metres. Finite and above 0.
    pub size: f32,
}

impl MarkerAnchor {
    /// Markers in the family tag36h11.
    pub const FAMILY_SIZE: u32 = 587;

    /// A marker of the family tag36h11 whose black square is `size` metres wide.
    pub fn new(id: u32, size: f32) -> Self {
        Self { id, size }
    }

    /// Whether such a marker can exist.
    ///
    /// # Errors
    /// [`TrackingError::NoSuchMarker`] or [`TrackingError::BadSize`].
    pub fn check(&self) -> Result<(), TrackingError> {
        if self.id >= Self::FAMILY_SIZE {
            return Err(TrackingError::NoSuchMarker(self.id));
        }
        if !(self.size.is_finite() && self.size > 0.0) {
            return Err(TrackingError::BadSize(self.size));
        }
        Ok(())
    }
}

/// On one [`MarkerAnchor`]: this anchor stays where it is and the camera moves around it.
///
/// With several of them the first (by entity) counts.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct WorldOrigin;

/// Whether a marker is in sight.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum MarkerState {
    /// Never seen yet.
    #[default]
    Searching,
    /// Seen in the newest picture.
    Tracked,
    /// Seen before, not in the newest picture; the last pose is kept.
    Lost,
}

/// What is known of a marker's pose; on the entity of its [`MarkerAnchor`].
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct MarkerTracking {
    /// Whether the marker is in sight.
    pub state: MarkerState,
    /// The last pose: marker frame → camera frame (Bevy axes), metres. `None` until first seen.
    pub camera_from_marker: Option<Isometry3d>,
    /// Both poses that explained the last picture, if one was found there.
    pub candidates: Option<PoseCandidates>,
    /// Reprojection error of the last pose in pixels.
    pub reprojection_error: f32,
    /// Sequence number of the picture in which the marker was last seen.
    pub last_seen: Option<u64>,
}

/// All markers in a camera's newest picture; on the entity of the camera.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct DetectedMarkers {
    /// Sequence number of the picture.
    pub sequence: u64,
    /// The markers, those without an anchor too.
    pub markers: Vec<DetectedMarker>,
    /// Time the detection took on the CPU.
    pub cpu_time: Duration,
}

/// Finds markers and moves the camera or the anchors.
pub struct TrackingPlugin;

impl Plugin for TrackingPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<MarkerAnchor>()
            .register_type::<WorldOrigin>()
            .register_type::<MarkerTracking>()
            .register_type::<DetectedMarkers>()
            .init_resource::<FramesAwaitTracking>()
            .add_systems(
                PreUpdate,
                (
                    track::check_anchors,
                    detection::detect_in_background,
                    detection::detect_at_once,
                    track::estimate_poses,
                    track::apply_poses,
                )
                    .chain()
                    .in_set(MirrorballSystems::Track),
            );
        if app.world().contains_resource::<MarkerDetection>() {
            return;
        }
        match MarkerDetection::built_in() {
            Ok(detection) => {
                app.insert_resource(detection);
            }
            Err(TrackingError::NoDetector) => {}
            Err(error) => error!("TrackingPlugin: {error}"),
        }
    }
}
