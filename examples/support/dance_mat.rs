//! The dance game's mat: a printed sheet with two markers and a field of dots for each arrow.

use bevy::prelude::*;
use bevy_mirrorball::tracking::{BoardMarker, MarkerAnchor, MarkerBoard, MarkerId};

/// Number of the marker at the left, which is the anchor; that at the right has the next one.
pub(crate) const MAT_MARKER: u32 = 20;
/// Width of the mat on A4 paper, which all lengths here are for, in meters.
pub(crate) const A4_WIDTH: f32 = 0.297;
/// Sides of the markers, distance of their middles.
const MARKER: f32 = 0.04;
const BETWEEN_MARKERS: f32 = 0.2;
/// Size of a field, distance of neighboring ones.
const FIELD: Vec2 = Vec2::new(0.056, 0.075);
const PITCH: f32 = 0.068;
/// Distance from the middles of the markers down to those of the fields.
const BELOW: f32 = 0.095;

/// A mat of some width.
#[derive(Clone, Copy)]
pub(crate) struct DanceMat {
    scale: f32,
}

impl DanceMat {
    /// A mat that fills a sheet of a width in meters.
    pub(crate) fn of_width(width: f32) -> Self {
        Self { scale: width / A4_WIDTH }
    }

    /// The marker that the mat is known by.
    pub(crate) fn anchor(self) -> MarkerAnchor {
        MarkerAnchor::new(MAT_MARKER, self.scale * MARKER)
    }

    /// The other marker.
    pub(crate) fn board(self) -> MarkerBoard {
        let place = Isometry3d::from_xyz(self.scale * BETWEEN_MARKERS, 0.0, 0.0);
        let other = MarkerId { id: MAT_MARKER + 1, ..self.anchor().marker() };
        MarkerBoard { markers: vec![BoardMarker::new(other, self.scale * MARKER, place)] }
    }

    pub(crate) fn field_size(self) -> Vec2 {
        self.scale * FIELD
    }

    /// Middles of the fields left, down, up and right: to the right of and below the middle of the anchor's marker.
    pub(crate) fn field_centers(self) -> [Vec2; 4] {
        [-1.5, -0.5, 0.5, 1.5].map(|place| self.scale * Vec2::new(0.5 * BETWEEN_MARKERS + place * PITCH, BELOW))
    }
}
