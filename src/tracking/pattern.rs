//! The printed pattern of a marker, and how it looks when it is blurred.

use bevy::math::DVec2;

/// Cells of a printed marker with what surrounds its square.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerPattern {
    /// Rows from top to bottom; `true` is white. Square.
    pub cells: Vec<Vec<bool>>,
    /// Number of cells along a side of the square whose corners are detected. It is in the middle of the cells.
    pub square: u32,
}

impl MarkerPattern {
    /// Reflectance at a position in cells, of edges that are blurred over `blur` cells to both sides.
    pub(super) fn shade(&self, cell: DVec2, blur: DVec2) -> Shade {
        let edge = cell.round();
        let (x, y) = (Crossing::new(cell.x - edge.x, blur.x), Crossing::new(cell.y - edge.y, blur.y));
        // Where blur reaches across a cell, two more cells on each axis count.
        let near = if blur.max_element() > 0.5 { 0..4 } else { 1..3 };
        let last = self.cells.len() as i32 - 1;
        let (mut value, mut by_cell, mut by_blur) = (0.0, DVec2::ZERO, 0.0);
        for j in near.clone() {
            let row = &self.cells[(edge.y as i32 + j as i32 - 2).clamp(0, last) as usize];
            for i in near.clone() {
                if row[(edge.x as i32 + i as i32 - 2).clamp(0, last) as usize] {
                    value += x.weight[i] * y.weight[j];
                    by_cell += DVec2::new(x.slope[i] * y.weight[j], x.weight[i] * y.slope[j]);
                    by_blur += x.by_blur[i] * y.weight[j] + x.weight[i] * y.by_blur[j];
                }
            }
        }
        Shade { value, by_cell, by_blur }
    }
}

/// Reflectance of the blurred pattern at a point, between 0 (ink) and 1 (paper), with its derivatives.
pub(super) struct Shade {
    pub(super) value: f64,
    pub(super) by_cell: DVec2,
    pub(super) by_blur: f64,
}

/// Weights of the four cells around an edge, on one axis, with their derivatives by position and by the logarithm of
/// the blur.
struct Crossing {
    weight: [f64; 4],
    slope: [f64; 4],
    by_blur: [f64; 4],
}

impl Crossing {
    /// At a distance of at most half a cell from the edge.
    fn new(from_edge: f64, blur: f64) -> Self {
        let edges = [1.0, 0.0, -1.0].map(|edge| {
            let t = ((from_edge + edge) / blur).clamp(-1.0, 1.0);
            let slope = (0.75 - 0.75 * t * t) / blur;
            (0.5 + 0.75 * t - 0.25 * t * t * t, slope, -slope * t * blur)
        });
        let [before, middle, after] = edges;
        let between = |first: f64, second: f64, third: f64| [-first, first - second, second - third, third];
        let mut weight = between(before.0, middle.0, after.0);
        weight[0] += 1.0;
        Self { weight, slope: between(before.1, middle.1, after.1), by_blur: between(before.2, middle.2, after.2) }
    }
}
