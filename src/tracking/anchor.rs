//! Markers that the game tracks.

use super::{
    MarkerFamily, MarkerId, MarkerTracking, MarkerViews, PoseFilter, TrackingError, filtered_pose::PoseHistories,
    marker_events::ReportedFound, same_number::FollowedSheets,
};
use bevy::prelude::*;

/// A printed AprilTag marker; the entity's frame is the marker's frame.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, tracking::MarkerFamily};
/// # fn setup(mut commands: Commands) {
/// // Marker 0, black square 10 cm wide, is the origin of the world; the camera moves around it.
/// commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
/// // Marker 7 is glued to a box that is pushed about.
/// commands.spawn(MarkerAnchor::new(7, 0.04));
/// // Another family.
/// commands.spawn(MarkerAnchor::new(7, 0.04).with_family(MarkerFamily::Tag25h9));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, MarkerTracking, MarkerViews, FollowedSheets, PoseFilter, PoseHistories, ReportedFound)]
pub struct MarkerAnchor {
    /// Family of the marker. Only families of anchors are searched for. Defaults to tag36h11.
    pub family: MarkerFamily,
    /// Number of the marker in its family (tag36h11: 0…586). Defaults to 0.
    pub id: u32,
    /// Side of the printed square in meters, finite and above 0. The square is the black one between white margin and
    /// data; in families [with the border inside](MarkerFamily::has_border_inside) the white one within the black
    /// ring. Defaults to 0.1, as the shipped sheet is printed.
    pub size: f32,
}

impl Default for MarkerAnchor {
    fn default() -> Self {
        Self::new(0, 0.1)
    }
}

impl MarkerAnchor {
    /// Number of markers in the family tag36h11.
    #[deprecated(since = "0.1.0", note = "use `MarkerFamily::marker_count`")]
    #[doc(hidden)]
    pub const FAMILY_SIZE: u32 = MarkerFamily::Tag36h11.marker_count();

    /// A marker of the family tag36h11 whose black square is `size` meters wide.
    pub fn new(id: u32, size: f32) -> Self {
        Self { family: MarkerFamily::Tag36h11, id, size }
    }

    /// The same number and size of another family.
    pub fn with_family(self, family: MarkerFamily) -> Self {
        Self { family, ..self }
    }

    /// What is printed on the marker.
    pub fn marker(&self) -> MarkerId {
        MarkerId::new(self.family, self.id)
    }

    /// Returns an error if no such marker can exist.
    ///
    /// # Errors
    /// [`TrackingError::NoSuchMarker`] or [`TrackingError::BadSize`].
    pub fn check(&self) -> Result<(), TrackingError> {
        self.marker().check()?;
        if !(self.size.is_finite() && self.size > 0.0) {
            return Err(TrackingError::BadSize(self.size));
        }
        Ok(())
    }
}

/// Marks the [`MarkerAnchor`] that stays in place while the camera moves around it.
///
/// If several anchors have it, the first by entity is the origin.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// fn setup(mut commands: Commands) {
///     commands.spawn((MarkerAnchor::new(0, 0.10), WorldOrigin));
///     // moves in the world of the first one
///     commands.spawn(MarkerAnchor::new(1, 0.10));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct WorldOrigin;
