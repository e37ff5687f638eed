//! The adjustment itself, on points with known noise.

use super::{BoardPose, grid, largest_difference, ten_views};
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::{
        Distortion,
        calibration::{CalibrationError, CalibrationPoint, CalibrationView, calibrate},
    },
    prelude::*,
};

const SIZE: UVec2 = UVec2::new(640, 480);
/// Side of the board's squares in meters; it has 9 × 7 inner corners.
const SQUARE: f64 = 0.025;

fn lens() -> Intrinsics {
    Intrinsics {
        distortion: Distortion { k1: -0.25, k2: 0.07, p1: 0.001, p2: -0.0015, k3: 0.0 },
        ..Intrinsics::new(Vec2::new(520.0, 523.0), Vec2::new(329.0, 234.0), SIZE)
    }
}

/// Deterministic noise in −1…1 without a preferred direction.
fn noise(seed: u32) -> DVec2 {
    let hash = |value: u32| {
        let value = (value ^ (value >> 16)).wrapping_mul(0x7feb_352d);
        let value = (value ^ (value >> 15)).wrapping_mul(0x846c_a68b);
        f64::from(value ^ (value >> 16)) / f64::from(u32::MAX) * 2.0 - 1.0
    };
    DVec2::new(hash(2 * seed + 1), hash(2 * seed + 7919))
}

fn view(pose: &BoardPose, number: u32, pixels: f64) -> CalibrationView {
    let point = |i: u32| {
        let board = DVec2::new(f64::from(i % 9), f64::from(i / 9)) * SQUARE;
        CalibrationPoint { board, frame: pose.seen(&lens(), board) + noise(number * 100 + i) * pixels }
    };
    let is_in_frame = |point: &CalibrationPoint| {
        point.frame.min_element() > 0.0 && (SIZE.as_dvec2() - point.frame).min_element() > 0.0
    };
    CalibrationView { points: (0..63).map(point).filter(is_in_frame).collect() }
}

fn views(pixels: f64) -> Vec<CalibrationView> {
    let poses = ten_views(Vec2::new(0.2, 0.15));
    poses.iter().enumerate().map(|(number, pose)| view(pose, number as u32, pixels)).collect()
}

#[test]
fn exact_points_give_the_lens() {
    let found = calibrate(SIZE, &views(0.0)).expect("enough views");
    let off = largest_difference(&lens(), &found.intrinsics, grid(SIZE));
    assert!(off < 0.02, "off by {off} px: {found:?}");
    assert!((found.intrinsics.focal - lens().focal).length() < 0.05, "{found:?}");
    assert!(found.reprojection_error < 1e-3 && found.used_views() == 10, "{found:?}");
}

#[test]
fn noise_is_averaged_and_bad_views_and_points_are_left_out() {
    let mut views = views(0.3);
    // The board was bent, or another corner was taken for the first; some points are off.
    let mut shifted = views[3].clone();
    shifted.points.iter_mut().for_each(|point| point.board.x += 0.15 * point.board.y * point.board.y / 0.15);
    views.insert(4, shifted);
    let mut turned = views[1].clone();
    let boards: Vec<DVec2> = turned.points.iter().map(|point| point.board).collect();
    turned
        .points
        .iter_mut()
        .zip(boards.iter().rev().step_by(2).cycle())
        .for_each(|(point, board)| point.board = *board);
    views.push(turned);
    views.push(CalibrationView { points: views[0].points[..5].to_vec() });
    for number in [7, 20, 33] {
        views[0].points[number].frame += DVec2::new(6.0, -9.0);
    }
    let found = calibrate(SIZE, &views).expect("enough views");
    let left_out: Vec<usize> = (0..views.len()).filter(|i| found.view_errors[*i].is_none()).collect();
    assert_eq!(left_out, [4, 11, 12]);
    let seen = views.iter().flat_map(|view| &view.points).map(|point| point.frame.as_vec2());
    let off = largest_difference(&lens(), &found.intrinsics, seen);
    assert!(off < 0.5, "off by {off} px: {found:?}");
    assert!((found.intrinsics.focal / lens().focal - 1.0).abs().max_element() < 0.003, "{found:?}");
    // Evenly distributed noise of 0.3 px in both directions has a root mean square of 0.3 · √(2 / 3).
    assert!((found.reprojection_error - 0.245).abs() < 0.03, "{found:?}");
    assert!(found.advice().iter().any(|advice| advice.contains("number 5, 12, 13")), "{:?}", found.advice());
}

#[test]
fn views_that_tell_nothing_are_refused_with_what_to_do() {
    let few = calibrate(SIZE, &views(0.2)[..2]).expect_err("two views");
    assert!(matches!(few, CalibrationError::TooFewViews { views: 2, usable: 2 }), "{few}");
    let board = Vec2::new(0.2, 0.15);
    let frontal: Vec<CalibrationView> = (0..6)
        .map(|i| BoardPose::new(board, Vec3::new(0.01 * i as f32, 0.0, 0.4), Vec2::ZERO, 20.0 * i as f32))
        .enumerate()
        .map(|(number, pose)| view(&pose, number as u32, 0.3))
        .collect();
    match calibrate(SIZE, &frontal) {
        Err(error @ CalibrationError::Undetermined(_)) => assert!(error.to_string().contains("slants"), "{error}"),
        other => panic!("frontal views cannot tell the focal length: {other:?}"),
    }
}

#[test]
fn the_written_file_is_read_as_the_same_lens() {
    let found = calibrate(SIZE, &views(0.1)).expect("enough views");
    let path = std::env::temp_dir().join(format!("mirrorball_calibration_{}.json", std::process::id()));
    found.save(&path).expect("a writable folder");
    let read = Intrinsics::open(&path);
    std::fs::remove_file(&path).expect("written above");
    assert_eq!(read.expect("a file of ours"), found.intrinsics);
}
