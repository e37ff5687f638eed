//! Position of a marker from the frames of several cameras.
//!
//! One frame tells well in which direction a marker is, and less well how far away: the distance comes from the
//! marker's width, which is small against it. Where two cameras see the marker from different sides, each knows what
//! the other lacks. The positions are combined with the inverses of their covariances as weights (best linear unbiased
//! estimate; Hartley & Zisserman 2004, ch. 12, for corners that are off by the same number of pixels everywhere).

use bevy::{
    math::{Mat3, Vec3A},
    prelude::*,
};
use std::time::Duration;

/// Largest difference between times of capture of frames that show the same moment.
const SAME_MOMENT: Duration = Duration::from_millis(20);

/// A marker in the frame of a camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sighting {
    pub world_from_camera: Isometry3d,
    pub camera_from_marker: Isometry3d,
    /// Focal length in pixels of the frame.
    pub focal: f32,
    /// Time of capture.
    pub captured: Duration,
}

impl Sighting {
    fn world_from_marker(&self) -> Isometry3d {
        self.world_from_camera * self.camera_from_marker
    }

    /// Inverse covariance of the position in world space, for corners that are off by a pixel. `marker_size` is the
    /// width of the marker in meters.
    fn information(&self, marker_size: f32) -> Mat3 {
        let in_camera = Vec3::from(self.camera_from_marker.translation);
        let distance = in_camera.length().max(f32::MIN_POSITIVE);
        let ray = self.world_from_camera.rotation * (in_camera / distance);
        // Four corners place the middle twice as well as one. The width of the square is off by a pixel.
        let across = (2.0 * self.focal / distance).powi(2);
        let along = (self.focal * marker_size / distance.powi(2)).powi(2);
        Mat3::from_diagonal(Vec3::splat(across)) + (along - across) * outer(ray)
    }
}

fn outer(v: Vec3) -> Mat3 {
    Mat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// Pose of a marker in world space, as the first camera sees it, at the position that all together give which saw it at
/// the same moment. `None` without a sighting.
pub(super) fn triangulate(sightings: &[Sighting], marker_size: f32) -> Option<Isometry3d> {
    let first = sightings.first()?;
    let pose = first.world_from_marker();
    let (mut information, mut weighted) = (Mat3::ZERO, Vec3::ZERO);
    for sighting in sightings.iter().filter(|other| other.captured.abs_diff(first.captured) <= SAME_MOMENT) {
        let of_one = sighting.information(marker_size);
        information += of_one;
        weighted += of_one * Vec3::from(sighting.world_from_marker().translation - pose.translation);
    }
    let shift = Some(information.inverse() * weighted).filter(|shift| shift.is_finite()).unwrap_or_default();
    Some(Isometry3d::new(pose.translation + Vec3A::from(shift), pose.rotation))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: f32 = 0.05;

    /// A camera at a place that looks at the origin, where a marker lies that it takes for `further` times as far away.
    fn sighting(eye: Vec3, further: f32) -> Sighting {
        let world_from_camera = Transform::from_translation(eye).looking_at(Vec3::ZERO, Vec3::Y).to_isometry();
        let mut camera_from_marker = world_from_camera.inverse();
        camera_from_marker.translation *= further;
        Sighting { world_from_camera, camera_from_marker, focal: 600.0, captured: Duration::ZERO }
    }

    fn error(sightings: &[Sighting]) -> f32 {
        triangulate(sightings, SIZE).expect("seen").translation.length()
    }

    #[test]
    fn one_camera_places_a_marker_alone() {
        let (here, wrong) = (sighting(Vec3::new(0.3, 0.5, 0.8), 1.0), sighting(Vec3::Z, 1.1));
        assert!(error(&[here]) < 1e-6);
        assert!((error(&[wrong]) - 0.1).abs() < 1e-6);
        assert!(triangulate(&[], SIZE).is_none());
    }

    #[test]
    fn two_cameras_mend_each_others_distances() {
        let (a, b) = (sighting(Vec3::new(0.8, 0.5, 0.6), 1.05), sighting(Vec3::new(-0.8, 0.5, 0.6), 0.96));
        let alone = error(&[a]).min(error(&[b]));
        assert!(error(&[a, b]) < 0.1 * alone, "{} {alone}", error(&[a, b]));
    }

    #[test]
    fn cameras_that_look_the_same_way_agree_on_the_mean() {
        let [far, near] = [1.02, 0.98].map(|further| sighting(Vec3::Z, further));
        // The one that takes it for nearer thinks that it knows a little better.
        assert!(error(&[near, far]) < 0.002);
    }

    #[test]
    fn a_frame_of_another_moment_does_not_count() {
        let late = Sighting { captured: Duration::from_millis(33), ..sighting(Vec3::X, 1.0) };
        let wrong = sighting(Vec3::Z, 1.1);
        assert!((error(&[wrong, late]) - 0.1).abs() < 1e-6);
        assert!(error(&[wrong, Sighting { captured: Duration::from_millis(15), ..late }]) < 0.01);
    }
}
