//! The board to print: a grid of markers.

use super::{Calibration, CalibrationError, CalibrationPoint, CalibrationView, calibrate};
use crate::{
    camera::{Distortion, FramePixels, Intrinsics, UndistortionMap},
    tracking::{DetectedMarker, MarkerDetector, MarkerFamily, MarkerId, detect_markers},
};
use bevy::{math::DVec2, prelude::*};

/// A grid of tag36h11 markers for calibration, numbered row by row from the upper left one.
///
/// Between two markers is a quarter of their size, white. Every marker is known by its number, so a board may be partly
/// out of view or covered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CalibrationBoard {
    /// Number of markers in a row. Defaults to 6.
    pub columns: u32,
    /// Number of rows. Defaults to 8.
    pub rows: u32,
    /// Number of the upper left marker. Defaults to 500, far from those of scenes. The last one is 586 at most.
    pub first_id: u32,
    /// Side of a black square in meters. Defaults to 0.024. Intrinsics do not depend on it.
    pub size: f64,
}

impl Default for CalibrationBoard {
    fn default() -> Self {
        Self { columns: 6, rows: 8, first_id: 500, size: 0.024 }
    }
}

/// Distance from one marker to the next, as a multiple of their size.
const PITCH: f64 = 1.25;
/// A marker with its white margin and a little more, as a multiple of its size.
const MARGIN: f64 = 1.3;
/// Largest size of the undistorted frames that are searched, as a multiple of the frames. Wider lenses lose what is
/// outside.
const MAX_CANVAS: f64 = 1.6;

impl CalibrationBoard {
    /// Returns an error if the grid is empty, has more markers than the family, or a size that is no length.
    ///
    /// # Errors
    /// [`CalibrationError::Board`].
    pub fn check(&self) -> Result<(), CalibrationError> {
        let last = u64::from(self.columns) * u64::from(self.rows) + u64::from(self.first_id);
        let family = MarkerFamily::Tag36h11.marker_count();
        if self.columns == 0 || self.rows == 0 || last > family.into() {
            return Err(CalibrationError::Board(format!(
                "{} × {} markers from number {} on; give at least one, the last of which is number {} or below",
                self.columns,
                self.rows,
                self.first_id,
                family - 1
            )));
        }
        if !(self.size.is_finite() && self.size > 0.0) {
            return Err(CalibrationError::Board(format!("markers of {} m; give a length above 0", self.size)));
        }
        Ok(())
    }

    /// Corners of a marker on the board in meters, in the order of [`DetectedMarker::corners`]. The upper left corner
    /// of the first marker is the origin. `None` if it is not on the board.
    pub fn corners(&self, id: u32) -> Option<[DVec2; 4]> {
        let i = id.checked_sub(self.first_id).filter(|i| i / self.columns < self.rows)?;
        let corner = DVec2::new(f64::from(i % self.columns), f64::from(i / self.columns)) * (PITCH * self.size);
        Some([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|side| corner + DVec2::from(side) * self.size))
    }

    /// The markers on the board.
    fn markers(&self) -> Vec<MarkerId> {
        (self.first_id..self.first_id + self.columns * self.rows).map(MarkerId::from).collect()
    }

    /// What a frame shows of the board. Markers that are not on it are ignored.
    pub fn view(&self, markers: &[DetectedMarker]) -> CalibrationView {
        let markers = markers.iter().filter(|marker| marker.family == MarkerFamily::Tag36h11);
        let points = markers.filter_map(|marker| Some((self.corners(marker.id)?, marker.corners)));
        let pair = |(board, frame)| CalibrationPoint { board, frame };
        CalibrationView { points: points.flat_map(|(board, frame)| board.into_iter().zip(frame)).map(pair).collect() }
    }

    /// Calibrates a camera from frames of one size in which the board is seen.
    ///
    /// Markers are detected twice. A lens bends the sides of markers and the detector lays straight lines through them,
    /// which moves corners by up to some tenths of a pixel. So after a first calibration the frames are undistorted
    /// with its result, and the corners that are found there are distorted again for the second one.
    ///
    /// # Errors
    /// [`CalibrationError::Board`], [`CalibrationError::Sizes`], [`CalibrationError::Detector`], and those of
    /// [`calibrate`].
    pub fn calibrate(
        &self,
        detector: &mut dyn MarkerDetector,
        frames: &[FramePixels],
    ) -> Result<Calibration, CalibrationError> {
        self.check()?;
        let size = frames.first().map_or(UVec2::ONE, |frame| frame.size);
        if let Some(other) = frames.iter().find(|frame| frame.size != size) {
            return Err(CalibrationError::Sizes(size, other.size));
        }
        detector.set_families(&[MarkerFamily::Tag36h11])?;
        let wanted = self.markers();
        let view_of = |mut markers: Vec<DetectedMarker>| {
            markers.retain(|marker| is_whole(marker, size));
            self.view(&markers)
        };
        let mut views: Vec<CalibrationView> =
            frames.iter().map(|frame| view_of(detect_markers(detector, frame, &wanted))).collect();
        let first = calibrate(size, &views)?;
        let lens = first.intrinsics;
        let pinhole = canvas(&lens, views.iter().flat_map(|view| &view.points).map(|point| point.frame));
        let map = UndistortionMap::onto(&lens, &pinhole);
        let shift = lens.center - pinhole.center;
        for (view, frame) in views.iter_mut().zip(frames) {
            let Some(undistorted) = map.undistort(frame) else {
                continue;
            };
            let mut markers = detect_markers(detector, &undistorted, &wanted);
            for corner in markers.iter_mut().flat_map(|marker| &mut marker.corners) {
                *corner = lens.distort_pixel(corner.as_vec2() + shift).as_dvec2();
            }
            let again = view_of(markers).points;
            view.points.retain(|point| again.iter().all(|other| other.board != point.board));
            view.points.extend(again);
        }
        calibrate(size, &views)
    }
}

/// Returns whether the white margin of a marker, an eighth of its size, is in the frame. Corners of others can be off
/// by pixels.
fn is_whole(marker: &DetectedMarker, size: UVec2) -> bool {
    let middle = 0.25 * marker.corners.iter().sum::<DVec2>();
    marker.corners.iter().all(|corner| {
        let outer = middle + (*corner - middle) * MARGIN;
        outer.min_element() > 1.0 && (size.as_dvec2() - outer).min_element() > 1.0
    })
}

/// A pinhole camera with the focal lengths of a lens whose frames hold what the lens shows at some pixels.
fn canvas(lens: &Intrinsics, pixels: impl Iterator<Item = DVec2>) -> Intrinsics {
    let size = lens.size.as_vec2();
    let surplus = 0.5 * (MAX_CANVAS as f32 - 1.0) * size;
    let (mut low, mut high) = (Vec2::ZERO, size);
    for pixel in pixels.filter_map(|pixel| lens.undistort_pixel(pixel.as_vec2())) {
        // The margin of a marker has to be seen too.
        low = low.min(pixel - 0.05 * size);
        high = high.max(pixel + 0.05 * size);
    }
    let (low, high) = (low.max(-surplus).floor(), high.min(size + surplus).ceil());
    Intrinsics { center: lens.center - low, size: (high - low).as_uvec2(), distortion: Distortion::NONE, ..*lens }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_are_numbered_row_by_row() {
        let board = CalibrationBoard { columns: 3, rows: 2, first_id: 10, size: 0.04 };
        let corners = board.corners(14).expect("in the second row");
        assert!((corners[0] - DVec2::new(0.05, 0.05)).length() < 1e-12);
        assert!((corners[2] - DVec2::new(0.09, 0.09)).length() < 1e-12);
        assert!(board.corners(9).is_none() && board.corners(16).is_none());
        let marker =
            |id| DetectedMarker { family: MarkerFamily::Tag36h11, id, corners: [DVec2::ONE; 4], corrected_bits: 0 };
        assert_eq!(board.view(&[marker(12), marker(3)]).points.len(), 4);
    }

    #[test]
    fn markers_at_the_border_are_not_whole() {
        let marker = |x: f64| DetectedMarker {
            family: MarkerFamily::Tag36h11,
            id: 0,
            corners: [(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)]
                .map(|corner| DVec2::new(x, 50.0) + DVec2::from(corner)),
            corrected_bits: 0,
        };
        let size = UVec2::new(640, 480);
        assert!(is_whole(&marker(8.0), size) && is_whole(&marker(592.0), size));
        assert!(!is_whole(&marker(5.0), size) && !is_whole(&marker(595.0), size));
    }

    #[test]
    fn boards_that_cannot_be_are_named() {
        let board = CalibrationBoard::default();
        assert!(board.check().is_ok());
        let said = CalibrationBoard { first_id: 580, ..board }.check().expect_err("too many").to_string();
        assert!(said.contains("580") && said.contains("586"), "{said}");
        assert!(CalibrationBoard { rows: 0, ..board }.check().is_err());
        assert!(CalibrationBoard { columns: u32::MAX, rows: u32::MAX, ..board }.check().is_err());
        assert!(CalibrationBoard { size: f64::NAN, ..board }.check().is_err());
    }
}
