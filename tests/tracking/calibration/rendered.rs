//! The printed board, rendered through a lens that bends lines: detected and calibrated as a user would do it, and
//! tracked with the result.

use super::{
    BoardPose, grid, largest_difference,
    render::{cells, lens, rays, render},
    ten_views,
};
use crate::pose_error::PoseError;
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::{CameraPlugin, Distortion, FramePixels, calibration::CalibrationBoard},
    prelude::*,
    tracking::{AprilTagDetector, MarkerPose, MarkerTracking, TrackingPlugin, detect_markers},
};
use std::f32::consts::{FRAC_PI_2, PI};

/// Of the focal lengths.
const FOCAL_TOLERANCE: f32 = 0.003;
/// In pixels, over the frame.
const PIXELS: f32 = 0.3;

#[test]
fn ten_views_of_the_printed_board_give_the_lens() {
    let (lens, board) = (lens(), CalibrationBoard::default());
    let (rays, cells) = (rays(&lens), cells(&board));
    let end = board.corners(board.first_id + board.columns * board.rows - 1).expect("the last marker")[2].as_vec2();
    let frames: Vec<FramePixels> = ten_views(end).iter().map(|pose| render(&lens, &rays, &cells, pose)).collect();
    let mut detector = AprilTagDetector::new().expect("the AprilTag library of this crate");
    let started = std::time::Instant::now();
    let found = board.calibrate(&mut detector, &frames).expect("enough views");
    let focal = found.intrinsics.focal / lens.focal - 1.0;
    // At the very corners, where no whole marker can be, the distortion is extrapolated.
    let inner = |at: Vec2| lens.size.as_vec2() * 0.5 + (at - lens.size.as_vec2() * 0.5) * 0.95;
    let off = largest_difference(&lens, &found.intrinsics, grid(lens.size).map(inner));
    println!("{:?}: focal lengths off by {focal}, pixels by {off}: {found:#?}", started.elapsed());
    assert_eq!(found.used_views(), 10);
    assert!(focal.abs().max_element() < FOCAL_TOLERANCE, "focal lengths are off by {focal}");
    assert!(off < PIXELS, "the lens is off by {off} px");
    assert!(found.coverage > 0.9, "{}", found.coverage);
    assert!(found.advice().is_empty(), "{:?}", found.advice());
}

/// Errors of a pose; without the distortion it is off by more than 1.5 % of the distance.
const DEGREES: f32 = 0.5;
const DISTANCE_SHARE: f32 = 0.003;

#[test]
fn a_marker_at_the_border_has_its_pose_once_the_lens_is_known() {
    let (lens, board) = (lens(), CalibrationBoard { columns: 1, rows: 1, first_id: 3, size: 0.06 });
    let middle = Vec3::new(-0.14, 0.08, 0.32);
    let pose = BoardPose::new(Vec2::splat(0.06), middle, Vec2::new(-35.0, 20.0), 15.0);
    // Our markers have z to the bottom edge and y out of the paper, our cameras y up and z backward.
    let rotation = Quat::from_rotation_x(PI) * pose.rotation * Quat::from_rotation_x(-FRAC_PI_2);
    let truth = Isometry3d::new(Vec3::new(middle.x, -middle.y, -middle.z), rotation);
    let frame = std::sync::Arc::new(render(&lens, &rays(&lens), &cells(&board), &pose));
    let tracked = |lens: Intrinsics| {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, TransformPlugin, CameraPlugin, TrackingPlugin));
        app.world_mut().spawn((MarkerAnchor::new(3, 0.06), WorldOrigin));
        let feed = CameraFeed::pixels(frame.clone()).with_pace(FeedPace::Lockstep);
        app.world_mut().spawn((ArCamera::new(lens), feed));
        app.update();
        let tracking = app.world_mut().query::<&MarkerTracking>().single(app.world()).expect("one anchor");
        tracking.candidates.as_ref().expect("the marker is in view").best
    };
    let known: MarkerPose = tracked(lens);
    PoseError::of(&known, &truth).assert_below("known lens", DEGREES, DISTANCE_SHARE);
    let pinhole = tracked(Intrinsics { distortion: Distortion::NONE, ..lens });
    let off = pinhole.camera_from_marker.translation.distance(truth.translation) / truth.translation.length();
    assert!(off > 5.0 * DISTANCE_SHARE, "the lens matters here: {off}");
}

#[test]
fn the_printed_page_is_the_board() {
    /// Pixels for each millimeter, and the page in pixels.
    const SCALE: f32 = 8.0;
    const PAGE: UVec2 = UVec2::new(1680, 2376);
    /// Height of the photograph of it, which has soft edges as those of cameras.
    const HEIGHT: u32 = 1000;
    let board = CalibrationBoard::default();
    let sheet = board.svg().expect("fits the page");
    let path = sheet.split("<path d=\"").nth(1).and_then(|rest| rest.split('"').next()).expect("the squares");
    let mut rgba = vec![255; (4 * PAGE.x * PAGE.y) as usize];
    for square in path.split('M').filter(|square| !square.is_empty()) {
        let numbers: Vec<f32> =
            square.split([' ', 'h', 'v', 'z']).filter_map(|number| number.parse().ok()).take(3).collect();
        let [x, y, side] = numbers[..] else { panic!("a square: {square}") };
        let pixels = |from: f32| (from * SCALE).round() as u32..((from + side) * SCALE).round() as u32;
        for (row, column) in pixels(y).flat_map(|row| pixels(x).map(move |column| (row, column))) {
            let at = 4 * (row * PAGE.x + column) as usize;
            rgba[at..at + 3].fill(0);
        }
    }
    let page = FramePixels::new(PAGE, rgba).expect("as many bytes as the size says").limited_to(HEIGHT);
    let mut detector = AprilTagDetector::new().expect("the AprilTag library of this crate");
    let points = board.view(&detect_markers(&mut detector, &page, &[])).points;
    assert_eq!(points.len(), 4 * 48);
    let corner = points.iter().find(|point| point.board == DVec2::ZERO).expect("the first marker").frame;
    let pixels = 1000.0 * page.size.as_dvec2() / PAGE.as_dvec2() * f64::from(SCALE);
    let errors = points.iter().map(|point| point.frame.distance(corner + point.board * pixels));
    let largest = errors.fold(0.0, f64::max);
    assert!(largest < 0.5, "corners are off by {largest} px");
}
