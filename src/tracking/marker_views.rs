//! Poses of a marker in the frames of several cameras.

use super::{BoardMarker, MarkerAnchor, MarkerBoard, MarkerFamily, MarkerTracking};
use bevy::{ecs::query::QueryData, math::Affine3A, prelude::*};

/// State and pose of a marker in the frames of each [`ArCamera`](crate::camera::ArCamera); on the entity of its
/// [`MarkerAnchor`]. With a single camera it equals the [`MarkerTracking`] beside it.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::tracking::MarkerViews;
/// fn print(markers: Query<&MarkerViews>) {
///     for (camera, view) in markers.iter().flat_map(MarkerViews::iter) {
///         println!("camera {camera}: {:?}", view.state);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct MarkerViews(Vec<(Entity, MarkerTracking)>);

impl MarkerViews {
    /// View of the marker in the frames of a camera, once one of them was searched for markers.
    pub fn get(&self, camera: Entity) -> Option<&MarkerTracking> {
        self.0.iter().find(|(of, _)| *of == camera).map(|(_, view)| view)
    }

    /// All views, each with the entity of its camera.
    pub fn iter(&self) -> impl Iterator<Item = (Entity, &MarkerTracking)> {
        self.0.iter().map(|(camera, view)| (*camera, view))
    }

    /// View in the frames of a camera, which is added if it is missing.
    pub(super) fn of(&mut self, camera: Entity) -> &mut MarkerTracking {
        let at = self.0.iter().position(|(of, _)| *of == camera).unwrap_or_else(|| {
            self.0.push((camera, MarkerTracking { camera: Some(camera), ..default() }));
            self.0.len() - 1
        });
        &mut self.0[at].1
    }

    /// Forgets the views of some cameras.
    pub(super) fn retain(&mut self, is_kept: impl Fn(Entity) -> bool) {
        self.0.retain(|(camera, _)| is_kept(*camera));
    }
}

/// Cosine of the largest angle between the normals of papers that are lit alike.
const MIN_PARALLEL_COSINE: f32 = 0.99;

/// A marker with its poses in the frames of all cameras.
#[derive(QueryData)]
pub(crate) struct SeenMarker {
    anchor: Ref<'static, MarkerAnchor>,
    board: Option<&'static MarkerBoard>,
    tracking: Ref<'static, MarkerTracking>,
    views: Option<Ref<'static, MarkerViews>>,
}

impl SeenMarkerItem<'_, '_> {
    /// White paper in a frame of a camera: the pose of a marker, as in [`pose_in`](Self::pose_in), and the side in
    /// meters of the tag36h11 marker whose white margin lies on its ring of white cells. It is the marker of the
    /// anchor, or if something lies on that, one of its board with the same normal.
    pub(crate) fn paper_in(&self, camera: Entity, sequence: u64) -> Option<(Affine3A, f32)> {
        let pose = self.pose_in(camera, sequence)?;
        let paper_size = |family: MarkerFamily, size| size * family.white_ring() / MarkerFamily::Tag36h11.white_ring();
        let own = (pose, paper_size(self.anchor.family, self.anchor.size));
        let Some(board) = self.board else {
            return Some(own);
        };
        let seen = &self.view_of(camera)?.markers;
        if seen.contains(&self.anchor.marker()) {
            return Some(own);
        }
        let is_visible = |marker: &&BoardMarker| {
            seen.contains(&marker.marker()) && (marker.place.rotation * Vec3::Y).dot(Vec3::Y) > MIN_PARALLEL_COSINE
        };
        let other = board.markers.iter().find(is_visible)?;
        Some((pose * Affine3A::from(other.place), paper_size(other.family, other.size)))
    }

    /// Pose in a frame of a camera: marker → camera. `None` if the marker was not detected in that frame.
    pub(crate) fn pose_in(&self, camera: Entity, sequence: u64) -> Option<Affine3A> {
        let view = self.view_of(camera).filter(|view| view.last_seen == Some(sequence))?;
        view.camera_from_marker.map(Affine3A::from)
    }

    /// Whether a camera has ever seen the marker.
    pub(crate) fn is_known_to(&self, camera: Entity) -> bool {
        self.view_of(camera).is_some_and(|view| view.camera_from_marker.is_some())
    }

    /// Whether the marker or one of its poses has changed.
    pub(crate) fn is_changed(&self) -> bool {
        self.anchor.is_changed()
            || self.tracking.is_changed()
            || self.views.as_ref().is_some_and(|views| views.is_changed())
    }

    /// View in the frames of a camera. A game that tracks by itself may set the [`MarkerTracking`] alone.
    fn view_of(&self, camera: Entity) -> Option<&MarkerTracking> {
        let view = self.views.as_ref().and_then(|views| views.get(camera));
        view.or_else(|| Some(&*self.tracking).filter(|tracking| tracking.camera.is_none_or(|of| of == camera)))
    }
}
