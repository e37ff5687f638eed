//! Dots of a button on a sheet, and its label.

use super::drawing::Drawing;
use crate::tracking::{TrackingError, buttons::DotGrid};
use bevy::math::{Rect, Vec2};

/// Height of labels, and their distance from the field, in millimeters.
const LABEL: f32 = 9.0;
const LABEL_GAP: f32 = 4.0;

/// A field of dots; lengths in millimeters from the center of the anchor's marker.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ButtonPrint {
    center: Vec2,
    size: Vec2,
    label: String,
}

impl ButtonPrint {
    /// A button from its middle and its size, in meters.
    pub(super) fn new(center: Vec2, size: Vec2, label: &str) -> Self {
        Self { center: 1000.0 * center, size: 1000.0 * size, label: label.to_owned() }
    }

    /// Rectangle around field and label.
    ///
    /// # Errors
    /// [`TrackingError::BadSize`] if the field has no size.
    pub(super) fn bounds(&self) -> Result<Rect, TrackingError> {
        let smallest = self.size.min_element();
        if !(self.center.is_finite() && self.size.is_finite() && smallest > 0.0) {
            return Err(TrackingError::BadSize(smallest / 1000.0));
        }
        let field = Rect::from_center_size(self.center, self.size);
        let label = if self.label.is_empty() { 0.0 } else { LABEL + LABEL_GAP };
        Ok(Rect { min: field.min - Vec2::new(0.0, label), ..field })
    }

    pub(super) fn draw(&self, drawing: &mut Drawing, shift: Vec2) {
        let grid = DotGrid::new(self.size);
        for center in grid.centers() {
            drawing.dot(self.center + center + shift, grid.dot_radius());
        }
        let above = self.center - Vec2::new(0.0, 0.5 * self.size.y + LABEL_GAP);
        drawing.label(above + shift, LABEL, &self.label);
    }
}
