//! Boards: several markers that are tracked as one anchor.

use super::{MarkerAnchor, MarkerFamily, MarkerId, TrackingError};
use bevy::prelude::*;

/// Further markers that are fixed to the marker of a [`MarkerAnchor`], on the entity of that anchor: on the same sheet,
/// on the sides of the same box. The pose of the anchor is then that of all markers that are in the frame, so that it
/// stays, and hardly changes, when some of them are hidden.
///
/// A marker that was moved against the others, or is not where the board says, is outvoted: the pose is that of those
/// that agree. From three markers on that is safe; of two that disagree the larger one in the frame counts.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, tracking::MarkerBoard};
/// # fn setup(mut commands: Commands) {
/// // Markers 0…4 on a carton 20 cm wide, 12 cm high and 15 cm deep: number 0 on its top, the others on its sides.
/// let anchor = MarkerAnchor::new(0, 0.08);
/// let board = MarkerBoard::box_sides(&anchor, Vec3::new(0.20, 0.12, 0.15), 0.08);
/// commands.spawn((anchor, board, WorldOrigin));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct MarkerBoard {
    /// The markers beside that of the anchor.
    pub markers: Vec<BoardMarker>,
}

/// A marker of a [`MarkerBoard`].
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct BoardMarker {
    /// The family.
    pub family: MarkerFamily,
    /// Number in the family.
    pub id: u32,
    /// Side of the square in meters, as [`MarkerAnchor::size`].
    pub size: f32,
    /// Place of the marker: its frame → frame of the anchor, in meters.
    pub place: Isometry3d,
}

impl BoardMarker {
    /// A marker at a place in the frame of the anchor.
    pub fn new(marker: impl Into<MarkerId>, size: f32, place: Isometry3d) -> Self {
        let MarkerId { family, id } = marker.into();
        Self { family, id, size, place }
    }

    /// A marker in the plane of the anchor's marker, upright as that one, with its center at `x` meters to the right
    /// and `z` to the bottom edge.
    pub fn beside(marker: impl Into<MarkerId>, size: f32, x: f32, z: f32) -> Self {
        Self::new(marker, size, Isometry3d::from_translation(Vec3::new(x, 0.0, z)))
    }

    /// What is printed on the marker.
    pub fn marker(&self) -> MarkerId {
        MarkerId::new(self.family, self.id)
    }
}

impl MarkerBoard {
    /// Free space between the place of the ball and the markers around it, in meters.
    pub const BALL_GAP: f32 = 0.003;

    /// A board of any markers.
    pub fn new(markers: impl IntoIterator<Item = BoardMarker>) -> Self {
        Self { markers: markers.into_iter().collect() }
    }

    /// Markers of the anchor's family and size in rows and columns, of which the anchor's is the first; the others have
    /// the next numbers, row by row. Their centers are `spacing` meters apart.
    pub fn grid(anchor: &MarkerAnchor, columns: u32, rows: u32, spacing: f32) -> Self {
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row))).skip(1);
        let markers = places.zip(1..).map(|((column, row), next)| {
            let (x, z) = (column as f32 * spacing, row as f32 * spacing);
            BoardMarker::beside(numbered_after(anchor, next), anchor.size, x, z)
        });
        Self::new(markers)
    }

    /// Six small markers of the anchor's family around the place of a mirrored ball: three above and three below it on
    /// the sheet, each row as wide as the ball, with the next six numbers. The ball touches the sheet at `ball` (to the
    /// right and to the bottom edge from the center of the anchor's marker) and has `radius`, in meters.
    pub fn around_ball(anchor: &MarkerAnchor, ball: Vec2, radius: f32) -> Self {
        let print = 2.0 * radius / 3.0;
        let size = anchor.family.size_in_print(print);
        let row = radius + Self::BALL_GAP + 0.5 * print;
        let places = [-row, row].into_iter().flat_map(|z| [-print, 0.0, print].map(|x| ball + Vec2::new(x, z)));
        let markers = places
            .zip(1..)
            .map(|(place, next)| BoardMarker::beside(numbered_after(anchor, next), size, place.x, place.y));
        Self::new(markers)
    }

    /// Markers in the middle of the four sides of a box, upright, the anchor's being in the middle of its top.
    /// `box_size` is width (along the top edge of the anchor's marker), height and depth in meters. The next four
    /// numbers are on the sides at the bottom edge of the anchor's marker, at its right, its top and its left edge.
    pub fn box_sides(anchor: &MarkerAnchor, box_size: Vec3, size: f32) -> Self {
        let sides = [Vec3::Z, Vec3::X, Vec3::NEG_Z, Vec3::NEG_X];
        let markers = sides.into_iter().zip(1..).map(|(outwards, next)| {
            // The marker's bottom edge is at the bottom of the box.
            let (out_of_paper, down) = (outwards, Vec3::NEG_Y);
            let rotation = Quat::from_mat3(&Mat3::from_cols(out_of_paper.cross(down), out_of_paper, down));
            let center = 0.5 * box_size * (outwards + Vec3::NEG_Y);
            BoardMarker::new(numbered_after(anchor, next), size, Isometry3d::new(center, rotation))
        });
        Self::new(markers)
    }

    /// Returns an error if the markers cannot form a board with that of the anchor.
    ///
    /// # Errors
    /// [`TrackingError::NoSuchMarker`] or [`TrackingError::BadSize`] for each marker; [`TrackingError::BadPlace`] if a
    /// place is not finite; [`TrackingError::DuplicateMarker`] if a marker is there twice.
    pub fn check(&self, anchor: &MarkerAnchor) -> Result<(), TrackingError> {
        let mut known = vec![anchor.marker()];
        for marker in &self.markers {
            let BoardMarker { family, id, size, place } = *marker;
            MarkerAnchor { family, id, size }.check()?;
            if !(place.translation.is_finite() && place.rotation.is_finite()) {
                return Err(TrackingError::BadPlace(marker.marker()));
            }
            if known.contains(&marker.marker()) {
                return Err(TrackingError::DuplicateMarker(marker.marker()));
            }
            known.push(marker.marker());
        }
        Ok(())
    }
}

/// The marker whose number is so many above the anchor's.
fn numbered_after(anchor: &MarkerAnchor, next: u32) -> MarkerId {
    MarkerId::new(anchor.family, anchor.id.saturating_add(next))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn anchor() -> MarkerAnchor {
        MarkerAnchor::new(10, 0.05)
    }

    #[test]
    fn a_grid_goes_on_row_by_row() {
        let board = MarkerBoard::grid(&anchor(), 3, 2, 0.07);
        let ids: Vec<_> = board.markers.iter().map(|marker| marker.id).collect();
        assert_eq!(ids, [11, 12, 13, 14, 15]);
        assert_eq!(board.markers[0].place.translation, Vec3::new(0.07, 0.0, 0.0).into());
        assert_eq!(board.markers[2].place.translation, Vec3::new(0.0, 0.0, 0.07).into());
        assert_eq!(board.check(&anchor()), Ok(()));
    }

    #[test]
    fn markers_around_the_ball_leave_its_place_free() {
        let (ball, radius) = (Vec2::new(0.17, 0.01), 0.05);
        let board = MarkerBoard::around_ball(&anchor(), ball, radius);
        assert_eq!(board.markers.len(), 6);
        for marker in &board.markers {
            let print = marker.size * 10.0 / 8.0;
            let from_ball = (Vec3::from(marker.place.translation).xz() - ball).abs();
            assert!((from_ball - 0.5 * print).max_element() >= radius, "{marker:?}");
            assert!((from_ball + 0.5 * print).x <= radius + 1e-6, "{marker:?}");
        }
    }

    #[test]
    fn sides_of_a_box_face_outwards_and_stand_upright() {
        let board = MarkerBoard::box_sides(&anchor(), Vec3::new(0.2, 0.1, 0.3), 0.04);
        let expected = [(Vec3::Z, 0.15), (Vec3::X, 0.1), (Vec3::NEG_Z, 0.15), (Vec3::NEG_X, 0.1)];
        for (marker, (outwards, distance)) in board.markers.iter().zip(expected) {
            let center = Vec3::from(marker.place.translation);
            assert!(center.distance(outwards * distance - Vec3::Y * 0.05) < 1e-6, "{marker:?}");
            assert!((marker.place.rotation * Vec3::Y).distance(outwards) < 1e-6, "{marker:?}");
            assert!((marker.place.rotation * Vec3::Z).distance(Vec3::NEG_Y) < 1e-6, "{marker:?}");
        }
    }

    #[test]
    fn boards_that_cannot_be_are_refused() {
        let refused = |marker| MarkerBoard::new([marker]).check(&anchor()).expect_err("not a board");
        assert_eq!(refused(BoardMarker::beside(587, 0.05, 0.1, 0.0)), TrackingError::NoSuchMarker(587.into()));
        assert_eq!(refused(BoardMarker::beside(1, 0.0, 0.1, 0.0)), TrackingError::BadSize(0.0));
        assert_eq!(refused(BoardMarker::beside(10, 0.05, 0.1, 0.0)), TrackingError::DuplicateMarker(10.into()));
        assert_eq!(refused(BoardMarker::beside(1, 0.05, f32::NAN, 0.0)), TrackingError::BadPlace(1.into()));
    }
}
