//! White paper of a marker: its radiance in a frame.

use crate::{
    camera::{FramePixels, Intrinsics},
    median::median_by,
};
use glam::{Affine3A, Vec2, Vec3};

/// Number of cells along the side of the black square of a tag36h11 marker.
pub(crate) const SQUARE_CELLS: f32 = 8.0;
/// Distance in cells from the center of a marker to the middle of the white margin around its black square.
pub(crate) const MARGIN_CELLS: f32 = 4.5;

/// Radiance of a marker's white paper, in linear camera units: the median over the white margin around the black
/// square.
///
/// `size` is the side of the black square in meters. The square is eight cells wide; every tag36h11 marker has a
/// margin of one cell around it (for other families see `SeenMarker::paper_in`). Returns `None` if most of the margin
/// is outside the frame.
pub(super) fn paper_radiance(
    frame: &FramePixels,
    intrinsics: &Intrinsics,
    camera_from_marker: &Affine3A,
    size: f32,
) -> Option<Vec3> {
    const STEPS: i32 = 36;
    let middle_of_margin = size * MARGIN_CELLS / SQUARE_CELLS;
    let mut samples = Vec::with_capacity(4 * STEPS as usize);
    for step in 0..STEPS {
        let along = (2.0 * step as f32 / STEPS as f32 - 1.0) * middle_of_margin;
        let edges = [
            (along, middle_of_margin),
            (along, -middle_of_margin),
            (middle_of_margin, along),
            (-middle_of_margin, along),
        ];
        for (x, z) in edges {
            let pixel = intrinsics.project(camera_from_marker.transform_point3(Vec3::new(x, 0.0, z)));
            samples.extend(
                pixel
                    .filter(|p| p.cmpge(Vec2::ZERO).all() && p.cmplt(frame.size.as_vec2()).all())
                    .map(|p| frame.linear(p.x as i32, p.y as i32)),
            );
        }
    }
    if samples.len() <= 2 * STEPS as usize {
        return None;
    }
    let mut median = |channel: usize| {
        median_by(&mut samples, |a, b| a[channel].total_cmp(&b[channel])).map(|sample| sample[channel])
    };
    Some(Vec3::new(median(0)?, median(1)?, median(2)?))
}
