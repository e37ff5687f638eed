//! How well views cover the frame, and what to do better.

use super::Calibration;
use bevy::{math::DVec2, prelude::*};

/// Columns and rows of cells that are counted as seen or not.
const CELLS: UVec2 = UVec2::new(8, 6);
/// Coverage below which the distortion is a guess where the board was never seen.
const GOOD_COVERAGE: f32 = 0.7;
/// Uncertainty of the focal length above which slants are missing.
const GOOD_UNCERTAINTY: f32 = 0.005;
/// Number of views with which errors of single ones hardly count.
const GOOD_VIEWS: usize = 8;
/// Re-projection error in pixels of a frame 640 pixels wide above which something is wrong with board or frames.
const GOOD_ERROR: f32 = 0.7;

/// Fraction of the cells of a frame in which there are points.
pub(super) fn coverage(size: UVec2, points: impl Iterator<Item = DVec2>) -> f32 {
    let mut seen = [false; (CELLS.x * CELLS.y) as usize];
    for point in points {
        let cell = (point / size.as_dvec2() * CELLS.as_dvec2()).max(DVec2::ZERO).as_uvec2().min(CELLS - 1);
        seen[(cell.y * CELLS.x + cell.x) as usize] = true;
    }
    seen.iter().filter(|seen| **seen).count() as f32 / seen.len() as f32
}

impl Calibration {
    /// What would make the calibration better, in sentences for the user; empty if it is good.
    pub fn advice(&self) -> Vec<String> {
        let mut advice = Vec::new();
        let (used, given) = (self.used_views(), self.view_errors.len());
        if self.coverage < GOOD_COVERAGE {
            advice.push(format!(
                "the board was seen in {:.0} % of the frame's area; elsewhere the distortion is a guess. Take views near all \
                 borders and in the corners",
                100.0 * self.coverage
            ));
        }
        if self.focal_uncertainty > GOOD_UNCERTAINTY {
            advice.push(format!(
                "the focal lengths are uncertain by {:.1} %; take views with the board slanted by 20° to 45° to each side",
                100.0 * self.focal_uncertainty
            ));
        }
        if used < GOOD_VIEWS {
            advice.push(format!("{used} views were usable; take {GOOD_VIEWS} or more"));
        }
        if used < given {
            let left_out: Vec<String> =
                (0..given).filter(|i| self.view_errors[*i].is_none()).map(|i| (i + 1).to_string()).collect();
            advice.push(format!(
                "views without enough of the board, or that do not fit the others, were left out: number {}",
                left_out.join(", ")
            ));
        }
        if self.reprojection_error > GOOD_ERROR * self.intrinsics.size.x as f32 / 640.0 {
            advice.push(format!(
                "the re-projection error of {:.2} px is large; hold board and camera still, keep the board flat, and the focus \
                 fixed",
                self.reprojection_error
            ));
        }
        let size = self.intrinsics.size.as_vec2();
        let corners = [Vec2::ZERO, Vec2::new(size.x, 0.0), size, Vec2::new(0.0, size.y)];
        if corners.iter().any(|corner| self.intrinsics.undistort_pixel(*corner).is_none()) {
            advice.push(
                "the distortion makes no sense in the corners of the frame; take views with the board there".to_owned(),
            );
        }
        advice
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Intrinsics;

    #[test]
    fn cells_with_points_are_counted_once() {
        let size = UVec2::new(640, 480);
        let points = [(1.0, 1.0), (79.0, 79.0), (640.0, 480.0), (-3.0, 250.0)].map(|(x, y)| DVec2::new(x, y));
        assert_eq!(coverage(size, points.into_iter()), 3.0 / 48.0);
    }

    #[test]
    fn advice_names_what_is_missing() {
        let good = Calibration {
            intrinsics: Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 1.0),
            reprojection_error: 0.2,
            view_errors: vec![Some(0.2); 10],
            coverage: 0.9,
            focal_uncertainty: 0.001,
        };
        assert!(good.advice().is_empty());
        let mut poor = Calibration { coverage: 0.4, focal_uncertainty: 0.02, reprojection_error: 1.2, ..good };
        poor.view_errors = vec![Some(0.2), None, Some(0.3)];
        poor.intrinsics.distortion.k1 = -1.5;
        let advice = poor.advice().join("\n");
        for part in ["40 %", "2.0 %", "2 views", "number 2", "1.20 px", "corners of the frame"] {
            assert!(advice.contains(part), "{part} is not in\n{advice}");
        }
    }
}
