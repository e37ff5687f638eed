//! Frames of a printed board through a lens that bends lines.

use super::BoardPose;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{Distortion, FramePixels, calibration::CalibrationBoard},
    prelude::*,
    tracking::marker_cells,
};

/// Rays for each pixel along a side.
const SAMPLES: u32 = 3;
/// Light of paper, ink and everything else in linear camera units.
const PAPER: f32 = 0.8;
const INK: f32 = 0.03;
const DESK: f32 = 0.3;

/// A lens that bends lines as cheap webcams do.
pub(crate) fn lens() -> Intrinsics {
    Intrinsics {
        distortion: Distortion { k1: -0.25, ..Distortion::NONE },
        ..Intrinsics::new(Vec2::new(580.0, 583.0), Vec2::new(327.0, 236.0), UVec2::new(640, 480))
    }
}

/// Directions of all rays of all pixels, at a depth of 1.
pub(crate) fn rays(lens: &Intrinsics) -> Vec<Vec2> {
    let side = lens.size * SAMPLES;
    let ray = |x: u32, y: u32| {
        let seen = (Vec2::new(x as f32, y as f32) + 0.5) / SAMPLES as f32;
        (lens.undistort_pixel(seen).expect("the lens shows its whole frame") - lens.center) / lens.focal
    };
    (0..side.y).flat_map(|y| (0..side.x).map(move |x| (x, y))).map(|(x, y)| ray(x, y)).collect()
}

/// Cells of the printed board, 10 for each marker and row, and the size of a cell in meters.
pub(crate) fn cells(board: &CalibrationBoard) -> (Vec<Vec<bool>>, f32) {
    let mut rows = vec![vec![true; 10 * board.columns as usize]; 10 * board.rows as usize];
    for i in 0..board.columns * board.rows {
        let (left, top) = (10 * (i % board.columns) as usize, 10 * (i / board.columns) as usize);
        let marker = marker_cells(board.first_id + i).expect("in the family");
        for (row, cells) in rows[top..].iter_mut().zip(&marker) {
            row[left..left + 10].copy_from_slice(cells);
        }
    }
    (rows, board.size as f32 / 8.0)
}

/// A frame with the board at a place.
pub(crate) fn render(
    lens: &Intrinsics,
    rays: &[Vec2],
    (cells, cell): &(Vec<Vec<bool>>, f32),
    pose: &BoardPose,
) -> FramePixels {
    let normal = pose.rotation * Vec3::Z;
    let (x, y) = (pose.rotation * Vec3::X, pose.rotation * Vec3::Y);
    let radiance = |ray: &Vec2| {
        let ray = ray.extend(1.0);
        let at = ray * (normal.dot(pose.translation) / normal.dot(ray)) - pose.translation;
        // The first cell is white margin.
        let (column, row) = ((at.dot(x) / cell + 1.0).floor(), (at.dot(y) / cell + 1.0).floor());
        if column < 0.0 || row < 0.0 {
            return DESK;
        }
        match cells.get(row as usize).and_then(|row| row.get(column as usize)) {
            Some(true) => PAPER,
            Some(false) => INK,
            None => DESK,
        }
    };
    let size = lens.size;
    let mut rgba = Vec::new();
    for (y, x) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (y, x))) {
        let row = |line: u32| (((y * SAMPLES + line) * size.x + x) * SAMPLES) as usize;
        let sum: f32 = (0..SAMPLES).flat_map(|line| &rays[row(line)..row(line) + SAMPLES as usize]).map(radiance).sum();
        let linear = sum / (SAMPLES * SAMPLES) as f32;
        let gray = Srgba::from(LinearRgba::rgb(linear, linear, linear)).to_u8_array()[0];
        rgba.extend([gray, gray, gray, 255]);
    }
    FramePixels::new(size, rgba).expect("as many bytes as the size says")
}
