//! What one frame shows of the dots of one field.
//!
//! A field's dots and its place in the frame enter; the light on every dot and on the paper around it leaves, in linear
//! light. Nothing is decided here, and nothing is kept from frame to frame.
//!
//! # Paper beside a dot
//! Paper is read at eight places around the dot, at half a pitch: four pairs of opposite ones. Where the straight edge
//! of a shadow or a sleeve passes beside a dot, each pair has a place on the dot's side of it. So the brighter place of
//! each pair is taken, and the darkest of these four: next to an edge, that is the paper in the dot's own light. If
//! something lies on the dot, a pair along its edge lies below it too, and shows no more light than the dot.

use super::dots::{DotGrid, MAX_DOTS, MAX_DOTS_PER_SIDE};
use glam::Vec2;

/// Smallest diameter of a dot, across its narrowest direction, in pixels.
pub(super) const MIN_DOT_PIXELS: f32 = 2.0;
/// Largest shift along each axis by which an error of the pose is undone, in pixels.
const MAX_SHIFT: f32 = 1.2;
/// Distance to the frame's edge that samples keep, in pixels.
const EDGE_PIXELS: f32 = 0.5 + MAX_SHIFT;
/// Distance from a dot's center of the samples around it, in units of its radius.
const SAMPLE_RADIUS: f32 = 0.6;
/// Directions of the samples around a dot's center: the corners of a hexagon.
const SAMPLE_DIRECTIONS: [Vec2; 6] = [
    Vec2::new(1.0, 0.0),
    Vec2::new(0.5, 0.866_025_4),
    Vec2::new(-0.5, 0.866_025_4),
    Vec2::new(-1.0, 0.0),
    Vec2::new(-0.5, -0.866_025_4),
    Vec2::new(0.5, -0.866_025_4),
];
/// Pairs of opposite places around a dot, in half pitches: along the row, along the column, along both diagonals.
const OPPOSITES: [[(i32, i32); 2]; 4] = [[(-1, 0), (1, 0)], [(0, -1), (0, 1)], [(-1, -1), (1, 1)], [(-1, 1), (1, -1)]];
/// Weight of the dots in the first and the last column; all others have 1.
const SIDE_WEIGHT: f32 = 0.5;
/// Number of places along a side at half pitches, ends included.
const PLACES: usize = 2 * MAX_DOTS_PER_SIDE + 1;

/// Linear light on one dot and on the paper around it, 0 (black) … 1 (the sensor's white).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DotReading {
    /// Mean over the dot.
    pub dot: f32,
    /// Paper in the same light as the dot.
    pub paper: f32,
    /// Which neighbors it has. Blur makes dots merge with their neighbors, so each kind has a contrast of its own.
    pub kind: DotKind,
}

/// Neighbors of a dot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum DotKind {
    /// Neighbors on all sides.
    #[default]
    Inner,
    /// In the first or the last column.
    Side,
    /// In the first or the last row.
    End,
    /// In both.
    Corner,
}

impl DotKind {
    /// Number of kinds.
    pub(super) const COUNT: usize = 4;

    /// Weight in the field's coverage. A neighbor's finger may graze the dots at the sides.
    pub(super) fn weight(self) -> f32 {
        match self {
            Self::Inner | Self::End => 1.0,
            Self::Side | Self::Corner => SIDE_WEIGHT,
        }
    }
}

/// Light on all dots of a field.
#[derive(Clone, Debug)]
pub(super) struct FieldReading {
    dots: [DotReading; MAX_DOTS],
    count: usize,
}

impl FieldReading {
    /// All dots, row by row.
    pub(super) fn dots(&self) -> &[DotReading] {
        &self.dots[..self.count]
    }
}

/// Reads a field. `project` takes positions in the field to pixels, `luminance` reads the frame there (bilinear,
/// linear, 0…1), `picture` is the frame's size in pixels. Returns `None` if the field is not wholly in the frame, or
/// too small in it.
pub(super) fn read_field(
    grid: &DotGrid,
    project: impl Fn(Vec2) -> Option<Vec2>,
    luminance: impl Fn(Vec2) -> f32,
    picture: Vec2,
) -> Option<FieldReading> {
    let columns = (grid.columns as usize).min(MAX_DOTS_PER_SIDE);
    let rows = (grid.rows as usize).min(MAX_DOTS_PER_SIDE);
    // The field is small: one linear map takes all dots' outlines to pixels.
    let radius = grid.dot_radius();
    let middle = project(Vec2::ZERO)?;
    let right = project(Vec2::new(radius, 0.0))? - middle;
    let down = project(Vec2::new(0.0, radius))? - middle;
    if 2.0 * smallest_stretch(right, down) < MIN_DOT_PIXELS {
        return None;
    }
    let around = SAMPLE_DIRECTIONS.map(|direction| SAMPLE_RADIUS * (direction.x * right + direction.y * down));

    let mut pixels = [[Vec2::ZERO; PLACES]; PLACES];
    for (y, row) in pixels.iter_mut().enumerate().take(2 * rows + 1) {
        for (x, pixel) in row.iter_mut().enumerate().take(2 * columns + 1) {
            *pixel = project(grid.at_half_pitches(x as u32, y as u32))?;
            let is_inside = pixel.cmpge(Vec2::splat(EDGE_PIXELS)).all() && pixel.cmple(picture - EDGE_PIXELS).all();
            if !is_inside {
                return None;
            }
        }
    }
    let shift = best_shift(&pixels, columns, rows, &luminance);
    let mut light = [[0.0; PLACES]; PLACES];
    for (y, row) in light.iter_mut().enumerate().take(2 * rows + 1) {
        for (x, value) in row.iter_mut().enumerate().take(2 * columns + 1) {
            let pixel = pixels[y][x] + shift;
            *value = luminance(pixel);
            if x % 2 == 1 && y % 2 == 1 {
                *value += around.iter().map(|&offset| luminance(pixel + offset)).sum::<f32>();
                *value /= (1 + around.len()) as f32;
            }
        }
    }

    let mut reading = FieldReading { dots: [DotReading::default(); MAX_DOTS], count: rows * columns };
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    for (dot, (row, column)) in reading.dots.iter_mut().zip(cells) {
        let (x, y) = (2 * column + 1, 2 * row + 1);
        let place = |(right, down): (i32, i32)| light[(y as i32 + down) as usize][(x as i32 + right) as usize];
        let paper = OPPOSITES.map(|[one, other]| place(one).max(place(other))).into_iter().fold(f32::MAX, f32::min);
        let kind = match (column == 0 || column + 1 == columns, row == 0 || row + 1 == rows) {
            (false, false) => DotKind::Inner,
            (true, false) => DotKind::Side,
            (false, true) => DotKind::End,
            (true, true) => DotKind::Corner,
        };
        *dot = DotReading { dot: light[y][x], paper, kind };
    }
    Some(reading)
}

/// Shift in pixels that makes the dots stand out most: the pose may be off by a pixel.
fn best_shift(
    pixels: &[[Vec2; PLACES]; PLACES],
    columns: usize,
    rows: usize,
    luminance: &impl Fn(Vec2) -> f32,
) -> Vec2 {
    // Light on the paper between all dots, less that on the dots.
    let contrast = |shift: Vec2| {
        let (mut paper, mut ink) = (0.0, 0.0);
        for row in pixels.iter().take(2 * rows + 1).step_by(2) {
            paper += row.iter().take(2 * columns + 1).step_by(2).map(|&pixel| luminance(pixel + shift)).sum::<f32>();
        }
        for row in pixels.iter().take(2 * rows).skip(1).step_by(2) {
            ink += row.iter().take(2 * columns).skip(1).step_by(2).map(|&pixel| luminance(pixel + shift)).sum::<f32>();
        }
        paper / ((columns + 1) * (rows + 1)) as f32 - ink / (columns * rows) as f32
    };
    let middle = contrast(Vec2::ZERO);
    let along = |axis: Vec2| {
        let (before, after) = (contrast(-axis), contrast(axis));
        let (slope, bend) = (0.5 * (after - before), before + after - 2.0 * middle);
        // The top of the parabola through three values, if it has one.
        if bend < 0.0 { (-slope / bend).clamp(-MAX_SHIFT, MAX_SHIFT) } else { MAX_SHIFT * slope.signum() }
    };
    Vec2::new(along(Vec2::X), along(Vec2::Y))
}

/// Length of the shortest vector that a linear map makes of unit vectors, by the images of the two axes.
fn smallest_stretch(x: Vec2, y: Vec2) -> f32 {
    // Singular values of a 2×2 matrix: their squares have the sum `s` and the product `d²`.
    let (s, d) = (x.length_squared() + y.length_squared(), x.perp_dot(y));
    let root = (s * s - 4.0 * d * d).max(0.0).sqrt();
    (0.5 * (s - root)).max(0.0).sqrt()
}
