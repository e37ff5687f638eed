//! The board as a page to print.

use super::{CalibrationBoard, CalibrationError};
use crate::tracking::{TrackingError, marker_cells};
use bevy::math::DVec2;
use std::fmt::Write;

/// Width and height of A4 in millimeters.
const PAGE: (f64, f64) = (210.0, 297.0);
/// Margin that printers need, and the place for the text below.
const MARGIN: f64 = 10.0;
const FOOT: f64 = 28.0;
/// Number of cells along a side of the black square.
const SQUARE_CELLS: f64 = 8.0;

impl CalibrationBoard {
    /// The board on an A4 page as SVG, with a scale bar to check that the printer did not shrink the page.
    ///
    /// # Errors
    /// [`CalibrationError::Board`] if it cannot be or does not fit.
    pub fn svg(&self) -> Result<String, CalibrationError> {
        self.check()?;
        let last = self.first_id + self.columns * self.rows - 1;
        let end = self.corners(last).map(|corners| corners[2] * 1000.0).unwrap_or_default();
        // Rounding is not what makes a board too large.
        let place = DVec2::new(PAGE.0, PAGE.1 - FOOT) - 2.0 * MARGIN + 1e-6;
        if (place - end).min_element() < 0.0 {
            return Err(CalibrationError::Board(format!(
                "it is {:.0} × {:.0} mm large and does not fit an A4 page; give fewer or smaller markers",
                end.x, end.y
            )));
        }
        let cell = 1000.0 * self.size / SQUARE_CELLS;
        let (left, top) = (0.5 * (PAGE.0 - end.x), 0.5 * (PAGE.1 - FOOT - end.y));
        let mut squares = String::new();
        for id in self.first_id..=last {
            let corner = self.corners(id).map(|corners| corners[0] * 1000.0).unwrap_or_default();
            let cells = marker_cells(id).ok_or(TrackingError::NoSuchMarker(id.into()))?;
            for (row, cells) in cells.iter().enumerate() {
                for (column, _) in cells.iter().enumerate().filter(|(_, is_white)| !**is_white) {
                    // The white margin is the first cell.
                    let x = left + corner.x + (column as f64 - 1.0) * cell;
                    let y = top + corner.y + (row as f64 - 1.0) * cell;
                    // Slightly larger than a cell, so that viewers draw no light gaps between neighbors.
                    let _ = write!(squares, "M{x:.3} {y:.3}h{0:.3}v{0:.3}h-{0:.3}z", cell + 0.01);
                }
            }
        }
        let (middle, below) = (0.5 * PAGE.0, top + end.y + 14.0);
        Ok(format!(
            r#"<svg xmlns="http://www.w3.org/2000/svg" width="{0}mm" height="{1}mm" viewBox="0 0 {0} {1}">
<rect width="100%" height="100%" fill="white"/>
<path d="{squares}"/>
<g font-family="sans-serif" font-size="4" text-anchor="middle">
<text x="{middle}" y="{below}">Calibration: tag36h11 numbers {2} to {last}, black squares {3:.1} mm.</text>
<text x="{middle}" y="{4}">Print at 100 % and keep it flat. This bar is 100 mm long:</text>
</g>
<path d="M{5} {6}h100" stroke="black" stroke-width="0.5"/>
</svg>
"#,
            PAGE.0,
            PAGE.1,
            self.first_id,
            1000.0 * self.size,
            below + 6.0,
            middle - 50.0,
            below + 10.0,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_does_not_fit_the_page_is_refused_with_its_size() {
        let sheet = CalibrationBoard::default().svg().expect("fits");
        assert!(sheet.contains("500 to 547") && sheet.contains("24.0 mm"), "{}", &sheet[sheet.len() - 600..]);
        let large = CalibrationBoard { size: 0.04, ..CalibrationBoard::default() };
        let said = large.svg().expect_err("290 mm wide").to_string();
        assert!(said.contains("290 × 390 mm") && said.contains("A4"), "{said}");
    }
}
