//! The error of a measured pose.

use bevy::prelude::*;
use bevy_mirrorball::tracking::MarkerPose;

/// Translation error as a share of the camera's distance. The width of an edge's blur is about this share of the
/// marker.
pub(crate) const DISTANCE_SHARE: f32 = 0.01;

/// How far a pose is from the truth.
#[derive(Clone, Copy)]
pub(crate) struct PoseError {
    degrees: f32,
    /// Translation error over the true distance.
    share: f32,
}

impl PoseError {
    pub(crate) fn of(pose: &MarkerPose, truth: &Isometry3d) -> Self {
        let found = pose.camera_from_marker;
        // `angle_between` takes the arc cosine, which cannot tell angles below 0.04° apart.
        let turn = found.rotation * truth.rotation.inverse();
        Self {
            degrees: (2.0 * turn.xyz().length().atan2(turn.w.abs())).to_degrees(),
            share: found.translation.distance(truth.translation) / truth.translation.length(),
        }
    }

    pub(crate) fn assert_below(self, what: &str, degrees: f32, share: f32) {
        println!("{what}: {:.3}° and {:.3} % of the distance", self.degrees, 100.0 * self.share);
        assert!(self.degrees < degrees, "{what}: turned by {}°, allowed are {degrees}°", self.degrees);
        assert!(self.share < share, "{what}: off by {} of the distance, allowed is {share}", self.share);
    }
}
