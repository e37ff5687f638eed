//! Marker tracking: frame → marker poses → camera pose or anchor transforms.
//!
//! **Enters:** the newest frame and the intrinsics of the camera, and [`MarkerAnchor`]s. **Leaves:**
//! [`DetectedMarkers`] on the camera, a [`MarkerTracking`] on each anchor, and moved [`Transform`]s.
//!
//! # Hand-over of frames
//! [`camera`](crate::camera) does not publish live frames itself when this plugin is present. This stage takes each of
//! them, searches it for markers in the background and publishes it as the [`CameraFrame`](crate::camera::CameraFrame)
//! together with its [`DetectedMarkers`], so background and poses change in the same update. Frames that are published
//! without (by feeds in lockstep and by the game itself) are searched within the update.
//!
//! # Frames of reference
//! The marker frame has its origin at the center of the black square, +X to the right, +Y out of the paper and +Z to
//! the bottom edge of the marker, upright *as the AprilTag project prints it* (OpenCV's dictionary prints it rotated
//! by 180°). A marker that lies on the desk has +Y up like the world. `camera_from_marker` is in Bevy's camera axes.
//!
//! # Families
//! All nine [families](MarkerFamily) of the AprilTag library, tag36h11 unless an anchor says otherwise. Those of the
//! anchors are searched for, no others. Which marker is which is always a matter of family and number.
//!
//! # Boards
//! A [`MarkerBoard`] beside a [`MarkerAnchor`] has further markers: on the same sheet, in a grid, on the sides of a
//! box. One fit over the corners of all that are in the frame gives the anchor's pose, so that any of them may be
//! hidden. It is also more exact, and not [ambiguous](PoseCandidates::is_ambiguous) where they are not all in one
//! plane.
//!
//! # Printed buttons
//! A [`VirtualButton`] is a field of dots on a marker's sheet. [`VirtualButtonState`] and the events [`ButtonCovered`]
//! and [`ButtonUncovered`] say when something covers it.
//!
//! # What moves
//! With [`WorldOrigin`] on one anchor, that anchor stays where the game put it and the camera moves. Without it the
//! camera stays and the anchors move. Distances are meters in the world, whatever the scale of the parents of cameras
//! and anchors.
//!
//! # Several cameras
//! Each [`ArCamera`](crate::camera::ArCamera) is posed by the markers in its own frames; [`MarkerViews`] has the poses
//! in all of them, [`MarkerTracking`] that of the first camera that tracks the marker (active cameras first, then by
//! `Camera::order`, then by entity). An anchor without [`WorldOrigin`] is placed where all cameras together see it that
//! see it at the same moment (within 20 ms) and whose pose is known. Two cameras that look from different sides know
//! its distance many times better than one (forty times in rendered frames).
//!
//! # Lost markers
//! A lost marker is a state, not an error: [`MarkerTracking::state`] changes, everything keeps its last pose, and
//! tracking resumes when the marker is detected again. It is held for a moment before it counts as lost.
//! [`MarkerFound`] and [`MarkerLost`] are triggered on the anchor when that changes, and [`any_marker_tracked`] and
//! [`world_origin_tracked`] are conditions for systems.
//!
//! # Stillness
//! The [`PoseFilter`] beside each anchor smooths the poses of live feeds: strongly at rest, hardly in motion. It runs
//! on the times of capture.
//!
//! # Several sheets with one number
//! Each anchor stays with the sheet that it followed, by its place in the frame, also while that sheet is out of sight
//! for up to 30 frames. [`MarkerTracking::copies`] counts the sheets, and a warning says once that there are several.
//!
//! # Mirrored frames
//! No marker can be read in a mirrored frame. [`DetectedMarkers::mirrored`] and a warning say so.
//!
//! # Accuracy
//! Corners are where the whole pattern of a marker fits the frame best, in linear light. On the recorded desk
//! (640 × 480, JPEG, the marker 80 pixels wide) the camera is off by 0.03° and 0.05 % of its distance in half of the
//! frames, by 0.18° and 0.3 % at most; in path-traced frames of 1280 × 720 markers are off by less than 0.03° and
//! 0.05 %. At rest, the filtered pose of a noisy marker (3 of 255, 100 pixels wide) has a standard deviation of 0.006°
//! and 0.003 %.
//!
//! # Range
//! Share of 100 frames in which a marker is found that moves and sways (blur of 0.8 pixels, noise of 3 of 255), and the
//! mean error of its distance, by the width of its square in the frame:
//!
//! | pixels | 12 | 14 | 16 | 18 | 20 | 24 | 30 | 40 | 60 | 100 |
//! |---|---|---|---|---|---|---|---|---|---|---|
//! | found | 0 | 0.68 | 1 | 1 | 1 | 1 | 1 | 1 | 1 | 1 |
//! | error in % | – | 0.55 | 0.51 | 0.27 | 0.32 | 0.22 | 0.09 | 0.08 | 0.05 | 0.02 |
//!
//! # Cost
//! A search takes 6 to 12 ms of CPU for a 640 × 480 frame and 25 to 40 ms for 1280 × 720 (with and without
//! optimization); four times that if a wanted marker is not detected at half resolution. A marker that is followed from
//! frame to frame takes 1 to 3 ms in both. Four printed buttons take 0.14 ms. It all runs in the background for live
//! feeds (`cargo bench --bench tracking`).

mod align_pattern;
mod anchor;
#[cfg(feature = "apriltag")]
mod apriltag;
#[cfg(feature = "apriltag")]
mod apriltag_family;
mod board;
mod board_pose;
mod buttons;
mod detect_markers;
mod detection;
mod detector;
mod error;
mod family;
mod filtered_pose;
#[cfg(feature = "locus")]
mod locus;
mod marker_events;
mod marker_tracker;
mod marker_views;
mod pattern;
mod placement;
mod pose;
mod pose_filter;
mod pose_fit;
#[cfg(feature = "apriltag")]
mod print;
mod recording;
mod same_number;
#[cfg(feature = "apriltag")]
mod sheet;
#[cfg(any(test, feature = "locus"))]
mod tag36h11;
mod track;
mod triangulate;

pub use anchor::{MarkerAnchor, WorldOrigin};
#[cfg(feature = "apriltag")]
pub use apriltag::AprilTagDetector;
#[cfg(feature = "apriltag")]
pub use apriltag_family::marker_cells;
pub use board::{BoardMarker, MarkerBoard};
pub use buttons::{ButtonCovered, ButtonUncovered, VirtualButton, VirtualButtonState};
pub use detect_markers::detect_markers;
pub use detection::MarkerDetection;
pub use detector::{DetectedMarker, LumaView, MarkerDetector};
pub use error::TrackingError;
pub use family::{MarkerFamily, MarkerId};
#[cfg(feature = "locus")]
pub use locus::LocusDetector;
pub use marker_events::{MarkerFound, MarkerLost, any_marker_tracked, world_origin_tracked};
pub use marker_tracker::MarkerTracker;
pub use marker_views::MarkerViews;
pub use pattern::MarkerPattern;
pub use pose::{MarkerPose, PoseCandidates};
pub use pose_filter::{FilterUse, PoseFilter};
#[cfg(feature = "apriltag")]
pub use print::marker_sheet_svg;
pub use recording::FrameRecorder;
#[cfg(feature = "apriltag")]
pub use sheet::{MarkerSheet, PaperSize};

pub(crate) use marker_views::SeenMarker;

use crate::{
    MirrorballSystems,
    camera::{FramePixels, FramesAwaitTracking, UndistortionMaps},
};
use bevy::prelude::*;
use std::time::Duration;

/// Old name of [`detect_markers`](fn@detect_markers).
#[deprecated(since = "0.1.0", note = "use `detect_markers`")]
#[doc(hidden)]
pub fn find_markers(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    wanted: &[MarkerId],
) -> Vec<DetectedMarker> {
    detect_markers(detector, frame, wanted)
}

/// Visibility of a marker.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum MarkerState {
    /// Not detected yet.
    #[default]
    Searching,
    /// Detected in the newest frame.
    Tracked,
    /// Detected a moment ago, but not in the newest frame: something is in the way or the frame is blurred. The last
    /// pose is kept. See [`PoseFilter::lost_after`].
    Held,
    /// Not detected for longer; the last pose is kept.
    Lost,
}

/// State and pose of a marker; on the entity of its [`MarkerAnchor`]. With several cameras, those of the first one that
/// tracks the marker; [`MarkerViews`] has the others.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::tracking::{MarkerState, MarkerTracking};
/// fn is_playable(markers: Query<&MarkerTracking>) -> bool {
///     markers.iter().any(|marker| marker.state == MarkerState::Tracked && marker.is_steady())
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct MarkerTracking {
    /// Visibility of the marker.
    pub state: MarkerState,
    /// The last pose: marker frame → camera frame (Bevy axes), in meters, smoothed as the [`PoseFilter`] says. `None`
    /// until the marker is first detected.
    pub camera_from_marker: Option<Isometry3d>,
    /// Both poses that explain the newest frame, as they are measured. `None` if the marker was not detected in it.
    pub candidates: Option<PoseCandidates>,
    /// Reprojection error of the last pose, in pixels.
    pub reprojection_error: f32,
    /// Sequence number of the frame in which the marker was last detected.
    pub last_seen: Option<u64>,
    /// Time of capture of that frame.
    pub last_seen_at: Option<Duration>,
    /// What [`is_steady`](Self::is_steady) returns.
    pub steady: bool,
    /// Number of markers in the newest frame that bear the anchor's family and number. If there are several, the pose
    /// is that of the one that was followed before, and of the largest at first.
    pub copies: u32,
    /// Markers that the last pose rests on: that of the anchor, and those of its [`MarkerBoard`] that agree.
    pub markers: Vec<MarkerId>,
    /// Camera whose frames show the marker so. `None` before the first frame, and for a game that tracks by itself:
    /// then it counts for every camera.
    pub camera: Option<Entity>,
}

impl MarkerTracking {
    /// Whether marker and camera have not moved against each other for 0.3 s: by less than about 1° and 2 % of the
    /// distance per second. A good moment to measure what takes several frames.
    pub fn is_steady(&self) -> bool {
        self.steady
    }
}

/// All markers in the newest frame of a camera; on the entity of the camera.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::tracking::DetectedMarkers;
/// fn list(detected: Query<&DetectedMarkers, Changed<DetectedMarkers>>) {
///     for marker in detected.iter().flat_map(|detected| &detected.markers) {
///         info!("{} at {}", marker.id, marker.corners[0]);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct DetectedMarkers {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// The markers, including those without an anchor.
    pub markers: Vec<DetectedMarker>,
    /// CPU time of the detection.
    pub cpu_time: Duration,
    /// Markers of anchors that are not in the frame, but in its mirror image: the frames are mirrored, as previews of
    /// front cameras are, and have to be turned around before they become frames. Looked for in every thirtieth frame
    /// without a wanted marker.
    pub mirrored: Vec<MarkerId>,
}

/// Detects markers and moves the camera or the anchors.
pub struct TrackingPlugin;

impl Plugin for TrackingPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.init_resource::<FramesAwaitTracking>()
            .init_resource::<UndistortionMaps>()
            .add_observer(recording::forget_past)
            .add_observer(recording::read_sidecar)
            .add_observer(recording::forget_sidecar)
            .add_systems(
                PreUpdate,
                (
                    track::check_anchors,
                    detection::detect_in_background,
                    detection::detect_at_once,
                    track::estimate_poses,
                    track::apply_poses,
                    marker_events::report_markers,
                    buttons::press_buttons,
                    recording::record_frames,
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
