//! Place of a mirrored ball on a sheet, and a paper ring to stand it on.

use super::{
    drawing::{Drawing, Line},
    millimeters,
};
use crate::tracking::TrackingError;
use bevy::math::{Rect, Vec2};
use std::f32::consts::TAU;

/// Radius of the ring, as a fraction of that of the ball.
const RING: f32 = 0.6;
/// Overlap at the end of a strip, for glue, in millimeters.
const TAB: f32 = 10.0;

/// A ball that touches the sheet; lengths in millimeters from the center of the anchor's marker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BallRing {
    center: Vec2,
    radius: f32,
}

impl BallRing {
    /// A ball from where it touches the sheet and its radius, in meters.
    pub(super) fn new(ball: Vec2, radius: f32) -> Self {
        Self { center: 1000.0 * ball, radius: 1000.0 * radius }
    }

    /// Square around the outline of the ball.
    ///
    /// # Errors
    /// [`TrackingError::BadSize`] if the ball has no size.
    pub(super) fn bounds(&self) -> Result<Rect, TrackingError> {
        if !(self.center.is_finite() && self.radius.is_finite() && self.radius > 0.0) {
            return Err(TrackingError::BadSize(self.radius / 1000.0));
        }
        Ok(Rect::from_center_half_size(self.center, Vec2::splat(self.radius)))
    }

    /// Height of a ring of which the ball's lowest point just reaches the sheet.
    fn ring_height(&self) -> f32 {
        self.radius * (1.0 - (1.0 - RING * RING).sqrt())
    }

    /// Sizes of the strips for the ring: one, or two halves if it is wider than the page.
    pub(super) fn strips(&self, width: f32) -> Result<Vec<Vec2>, TrackingError> {
        self.bounds()?;
        let around = TAU * RING * self.radius;
        let pieces = if around + TAB > width { 2 } else { 1 };
        Ok(vec![Vec2::new(around / pieces as f32 + TAB, self.ring_height()); pieces])
    }

    pub(super) fn draw_place(&self, drawing: &mut Drawing, shift: Vec2) {
        let center = self.center + shift;
        drawing.circle(Line::Cut, center, self.radius);
        drawing.circle(Line::Fold, center, RING * self.radius);
        for arm in [Vec2::X, Vec2::Y] {
            drawing.line(Line::Cut, &[center - 3.0 * arm, center + 3.0 * arm], false);
        }
    }

    pub(super) fn draw_strip(&self, drawing: &mut Drawing, start: Vec2, size: Vec2) {
        let end = start + size;
        drawing.line(Line::Cut, &[start, Vec2::new(end.x, start.y), end, Vec2::new(start.x, end.y)], true);
        let tab = end.x - TAB;
        drawing.line(Line::Fold, &[Vec2::new(tab, start.y), Vec2::new(tab, end.y)], false);
    }

    pub(super) fn caption(&self) -> String {
        let mm = |length: f32| millimeters(length / 1000.0);
        format!(
            "Place of the ball: diameter {} mm, {} mm to the right of and {} mm below the middle of the first marker. \
             Cut out the strip ({} mm high), glue it to a ring {} mm wide, the end over the dashed line, and put it on \
             the dashed circle: the ball on it touches the sheet.",
            mm(2.0 * self.radius),
            mm(self.center.x),
            mm(self.center.y),
            mm(self.ring_height()),
            mm(2.0 * RING * self.radius),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ball_on_its_ring_touches_the_sheet() {
        let ball = BallRing::new(Vec2::ZERO, 0.05);
        // The rim of the ring is on the ball: as far from the ball's center as its radius.
        let rim = Vec2::new(RING * ball.radius, ball.ring_height() - ball.radius);
        assert!((rim.length() - ball.radius).abs() < 1e-4, "{rim}");
        assert!((ball.ring_height() - 10.0).abs() < 1e-4);
    }

    #[test]
    fn a_ring_that_is_wider_than_the_page_has_two_halves() {
        let ball = BallRing::new(Vec2::ZERO, 0.05);
        let around = TAU * 30.0;
        for (width, count) in [(200.0, 1), (190.0, 2)] {
            let strips = ball.strips(width).expect("a ball");
            assert_eq!(strips.len(), count);
            assert!((strips.iter().map(|strip| strip.x - TAB).sum::<f32>() - around).abs() < 1e-3);
        }
        assert_eq!(BallRing::new(Vec2::ZERO, 0.0).strips(200.0), Err(TrackingError::BadSize(0.0)));
    }
}
