//! Dots that are printed on a field: where they are, and the paper between them.
//!
//! A size enters, in any unit; places leave in the same unit, as positions in the field: its middle is the origin, +X
//! points to the right and +Y to the player. The pattern is free of scale. Round dots, because squares would be
//! candidates for markers.

use glam::Vec2;

/// Largest number of dots along a side.
pub(super) const MAX_DOTS_PER_SIDE: usize = 10;
/// Largest number of dots of a field.
pub(super) const MAX_DOTS: usize = MAX_DOTS_PER_SIDE * MAX_DOTS_PER_SIDE;
/// Number of dots along the shorter side.
const DOTS_ALONG_SHORTER: f32 = 5.0;
/// Radius of a dot, in units of the smaller pitch: the diameter is 0.55 of it.
const DOT_RADIUS: f32 = 0.275;

/// Regular grid of dots that fills a field. Print nothing else on it, nor within a quarter of the pitch around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct DotGrid {
    /// Width and height of the field.
    pub size: Vec2,
    /// Number of dots from left to right, 2…10.
    pub columns: u32,
    /// Number of dots from top to bottom, 2…10.
    pub rows: u32,
}

impl DotGrid {
    /// Five dots along the shorter side, and as many along the other as the same pitch gives, but at most ten.
    pub(crate) fn new(size: Vec2) -> Self {
        let pitch = size.min_element() / DOTS_ALONG_SHORTER;
        let count = |side: f32| ((side / pitch).round() as u32).clamp(2, MAX_DOTS_PER_SIDE as u32);
        Self { size, columns: count(size.x), rows: count(size.y) }
    }

    /// Distances of neighboring dots, along a row and along a column.
    pub(crate) fn pitch(&self) -> Vec2 {
        self.size / Vec2::new(self.columns as f32, self.rows as f32)
    }

    /// Radius of the dots.
    pub(crate) fn dot_radius(&self) -> f32 {
        DOT_RADIUS * self.pitch().min_element()
    }

    /// Centers of all dots, to print them, row by row from the top left.
    #[cfg(feature = "apriltag")]
    pub(crate) fn centers(&self) -> impl Iterator<Item = Vec2> {
        let grid = *self;
        let columns = move |row| (0..grid.columns).map(move |column| grid.at_half_pitches(2 * column + 1, 2 * row + 1));
        (0..grid.rows).flat_map(columns)
    }

    /// Position at a number of half pitches from the upper left corner. Dots are where both numbers are odd, paper is
    /// everywhere else.
    pub(super) fn at_half_pitches(&self, x: u32, y: u32) -> Vec2 {
        0.5 * (Vec2::new(x as f32, y as f32) * self.pitch() - self.size)
    }
}
