//! Homographies from the plane of a board to a frame.

use super::CalibrationPoint;
use crate::least_squares::NormalEquations;
use bevy::math::{DMat3, DVec2, DVec3};

/// The homography that maps points of the board to their pixels, by the direct linear transform on normalized
/// coordinates (Hartley 1997). `None` for fewer than 4 points, or if they are on a line.
pub(super) fn homography(points: &[CalibrationPoint]) -> Option<DMat3> {
    if points.len() < 4 {
        return None;
    }
    let from_board = normalization(points.iter().map(|point| point.board))?;
    let from_frame = normalization(points.iter().map(|point| point.frame))?;
    let mut equations = NormalEquations::new(8);
    for point in points {
        let DVec3 { x, y, .. } = from_board * point.board.extend(1.0);
        let DVec3 { x: u, y: v, .. } = from_frame * point.frame.extend(1.0);
        equations.add(&[(0, x), (1, y), (2, 1.0), (6, -u * x), (7, -u * y)], u, 1.0);
        equations.add(&[(3, x), (4, y), (5, 1.0), (6, -v * x), (7, -v * y)], v, 1.0);
    }
    let h = equations.solve_unbounded()?;
    let rows = DMat3::from_cols_array(&[h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0]);
    let frame_from_board = from_frame.inverse() * rows.transpose() * from_board;
    frame_from_board.is_finite().then_some(frame_from_board)
}

/// Similarity that moves points around the origin, at a mean distance of √2.
fn normalization(points: impl Iterator<Item = DVec2> + Clone) -> Option<DMat3> {
    let count = points.clone().count() as f64;
    let middle = points.clone().sum::<DVec2>() / count;
    let distance = points.map(|point| point.distance(middle)).sum::<f64>() / count;
    let scale = std::f64::consts::SQRT_2 / distance;
    scale.is_finite().then(|| DMat3::from_scale(DVec2::splat(scale)) * DMat3::from_translation(-middle))
}

/// Root mean square of the distances between pixels and what a homography makes of their points.
pub(super) fn error(frame_from_board: &DMat3, points: &[CalibrationPoint]) -> f64 {
    let square = |point: &CalibrationPoint| {
        let at = *frame_from_board * point.board.extend(1.0);
        (at.truncate() / at.z).distance_squared(point.frame)
    };
    (points.iter().map(square).sum::<f64>() / points.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_homography_maps_the_points_it_is_made_of() {
        let truth = DMat3::from_cols_array(&[800.0, 30.0, 0.2, -20.0, 700.0, -0.4, 300.0, 200.0, 1.0]);
        let point = |x: f64, y: f64| {
            let at = truth * DVec3::new(x, y, 1.0);
            CalibrationPoint { board: DVec2::new(x, y), frame: at.truncate() / at.z }
        };
        let points: Vec<_> = (0..12).map(|i| point(0.03 * f64::from(i % 4), 0.03 * f64::from(i / 4))).collect();
        let found = homography(&points).expect("a plane");
        assert!(error(&found, &points) < 1e-8, "{}", error(&found, &points));
        let line: Vec<_> = (0..9).map(|i| point(0.01 * f64::from(i), 0.0)).collect();
        let of_line = homography(&line).map_or(f64::INFINITY, |found| error(&found, &points));
        assert!(of_line.is_nan() || of_line > 10.0, "a line determines no plane, and found is one: {of_line}");
        assert!(homography(&points[..3]).is_none());
    }
}
