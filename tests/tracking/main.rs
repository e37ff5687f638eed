//! Camera feeds, the frame behind the scene, marker detection and poses, and authored scenes.

mod authoring;
mod background;
mod bsn;
#[cfg(feature = "apriltag")]
mod buttons;
mod calibration;
#[cfg(feature = "apriltag")]
mod boards;
#[cfg(feature = "apriltag")]
mod desk_clip;
mod families;
#[cfg(feature = "apriltag")]
mod far_markers;
mod feeds;
mod follow;
#[path = "../support/gpu.rs"]
mod gpu;
mod lens;
#[cfg(all(feature = "apriltag", feature = "locus"))]
mod locus;
mod marker_events;
#[cfg(feature = "apriltag")]
mod pose_error;
#[cfg(feature = "apriltag")]
mod pose_truth;
#[cfg(feature = "apriltag")]
mod print;
#[cfg(feature = "apriltag")]
mod real_tags;
#[cfg(feature = "apriltag")]
mod rendered_tags;
#[cfg(feature = "apriltag")]
mod recordings;
#[cfg(feature = "apriltag")]
#[path = "../support/rendered_marker.rs"]
mod rendered_marker;
mod scripted_desk;
mod several_cameras;
#[cfg(feature = "apriltag")]
mod sheets;
#[cfg(feature = "apriltag")]
#[path = "../support/shared_data.rs"]
mod shared_data;
#[cfg(feature = "apriltag")]
mod stereo;
#[cfg(feature = "apriltag")]
mod still_poses;
#[cfg(feature = "webcam")]
mod webcam;
