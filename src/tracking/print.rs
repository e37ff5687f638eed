//! Printable sheets of markers.

use super::{MarkerAnchor, TrackingError, marker_cells};
use std::fmt::Write;

/// Width and height of A4 in millimeters.
const PAGE: (f32, f32) = (210.0, 297.0);
/// Number of cells along a side of the black square.
const SQUARE_CELLS: f32 = 8.0;

/// An A4 page with one tag36h11 marker as SVG: the black square, `size` meters wide, with its white margin, its
/// number, and a scale bar to check that the printer did not shrink the page.
///
/// # Errors
/// [`TrackingError::NoSuchMarker`], or [`TrackingError::BadSize`] if the marker does not fit the page;
/// [`TrackingError::OutOfMemory`].
pub fn marker_sheet_svg(id: u32, size: f32) -> Result<String, TrackingError> {
    MarkerAnchor::new(id, size).check()?;
    let cell = size * 1000.0 / SQUARE_CELLS;
    if 10.0 * cell > PAGE.0 - 10.0 {
        return Err(TrackingError::BadSize(size));
    }
    let cells = marker_cells(id).ok_or(TrackingError::OutOfMemory)?;
    let (left, top) = (0.5 * PAGE.0 - 5.0 * cell, 0.5 * PAGE.1 - 5.0 * cell);
    let mut squares = String::new();
    for (row, cells) in cells.iter().enumerate() {
        for (column, _) in cells.iter().enumerate().filter(|(_, is_white)| !**is_white) {
            let (x, y) = (left + column as f32 * cell, top + row as f32 * cell);
            // Slightly larger than a cell, so that viewers draw no light gaps between neighbors.
            let _ = write!(squares, "M{x:.3} {y:.3}h{0:.3}v{0:.3}h-{0:.3}z", cell + 0.01);
        }
    }
    let millimeters = size * 1000.0;
    let (middle, below) = (0.5 * PAGE.0, top + 10.0 * cell + 12.0);
    Ok(format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="{}mm" height="{}mm" viewBox="0 0 {} {}">
<rect width="100%" height="100%" fill="white"/>
<path d="{squares}"/>
<path d="M{middle} {} l3 5h-6z"/>
<g font-family="sans-serif" font-size="4" text-anchor="middle">
<text x="{middle}" y="{}">top edge</text>
<text x="{middle}" y="{below}">tag36h11 number {id}, black square {millimeters} mm. Print at 100 %.</text>
<text x="{middle}" y="{}">This bar is 100 mm long:</text>
</g>
<path d="M{} {}h100" stroke="black" stroke-width="0.5"/>
</svg>
"#,
        PAGE.0,
        PAGE.1,
        PAGE.0,
        PAGE.1,
        top - 14.0,
        top - 16.0,
        below + 8.0,
        middle - 50.0,
        below + 12.0,
    ))
}
