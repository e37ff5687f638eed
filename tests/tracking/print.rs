//! The printed marker sheet against the detector: the same marker, the same axes and the promised size.

use crate::{
    lens::LENS,
    pose_error::{DISTANCE_SHARE, PoseError},
};
use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::{
    camera::FramePixels,
    tracking::{AprilTagDetector, PoseCandidates, TrackingError, detect_markers, marker_sheet_svg},
};
use std::{fs, path::Path};

/// Side of the black square in meters.
const SIZE: f32 = 0.10;
/// Cells along a side of the sheet: the black square has 8, its white margin adds one on each side.
const SHEET_CELLS: usize = 10;
/// Side of a cell in meters.
const CELL: f32 = SIZE / 8.0;
/// Rotation: an object 0.2 m from the marker is then off by about 1 mm.
const DEGREES: f32 = 0.3;

fn cells() -> Vec<Vec<bool>> {
    AprilTagDetector::new().expect("the AprilTag library of this crate").cells(0).expect("marker 0 exists")
}

/// Light that the sheet's plane sends out at a point of the marker frame, in linear camera units.
fn radiance(cells: &[Vec<bool>], x: f32, z: f32) -> f32 {
    const DESK: f32 = 0.3;
    const PAPER: f32 = 0.8;
    const INK: f32 = 0.03;
    let half = 0.5 * SHEET_CELLS as f32;
    let (column, row) = ((x / CELL + half).floor(), (z / CELL + half).floor());
    if column < 0.0 || row < 0.0 {
        return DESK;
    }
    match cells.get(row as usize).and_then(|row| row.get(column as usize)) {
        Some(true) => PAPER,
        Some(false) => INK,
        None => DESK,
    }
}

/// A picture of the sheet lying at y = 0. Each pixel collects light from a square of `aperture` pixels, in nine rays
/// for each pixel's width: 1 is sharp, more is out of focus.
fn photograph(marker_from_camera: Isometry3d, aperture: u32) -> FramePixels {
    let (intrinsics, cells, samples) = (LENS, cells(), 3 * aperture);
    let eye = marker_from_camera.translation;
    let sample = |pixel: Vec2| {
        let ray = marker_from_camera.rotation * intrinsics.ray(pixel);
        let distance = -eye.y / ray.y;
        assert!(distance > 0.0, "the whole picture shows the desk");
        radiance(&cells, eye.x + distance * ray.x, eye.z + distance * ray.z)
    };
    let offset = |i: u32| 0.5 + (i as f32 + 0.5 - 0.5 * samples as f32) / 3.0;
    let size = intrinsics.size;
    let mut rgba = Vec::new();
    for (y, x) in (0..size.y).flat_map(|y| (0..size.x).map(move |x| (y, x))) {
        let corner = UVec2::new(x, y).as_vec2();
        let sum: f32 =
            (0..samples * samples).map(|i| sample(corner + Vec2::new(offset(i % samples), offset(i / samples)))).sum();
        let linear = sum / (samples * samples) as f32;
        let gray = Srgba::from(LinearRgba::rgb(linear, linear, linear)).to_u8_array()[0];
        rgba.extend([gray, gray, gray, 255]);
    }
    FramePixels::new(size, rgba).expect("as many bytes as the size says")
}

/// Photographs the sheet, tracks it and compares with the camera's true pose.
fn assert_pose_is_recovered(what: &str, camera: Transform, aperture: u32) {
    let truth = camera.to_isometry().inverse();
    let mut detector = AprilTagDetector::new().expect("the AprilTag library of this crate");
    let markers = detect_markers(&mut detector, &photograph(camera.to_isometry(), aperture), &[0.into()]);
    assert_eq!(markers.iter().map(|marker| marker.id).collect::<Vec<_>>(), [0], "markers found");
    let candidates = PoseCandidates::from_corners(&markers[0].corners, &LENS, SIZE.into()).expect("a pose");
    PoseError::of(&candidates.best, &truth).assert_below(what, DEGREES, DISTANCE_SHARE);
}

/// A camera that looks almost at the marker, turned about its line of sight.
fn camera(eye: Vec3, roll: f32) -> Transform {
    let mut camera = Transform::from_translation(eye).looking_at(Vec3::new(0.02, 0.0, -0.01), Vec3::Y);
    camera.rotate_local_z(roll);
    camera
}

#[test]
fn a_photographed_sheet_gives_the_pose_of_its_camera() {
    let views = [
        (Vec3::new(0.05, 0.45, 0.30), 0.0),
        (Vec3::new(-0.25, 0.40, 0.20), 0.6),
        (Vec3::new(0.30, 0.42, -0.25), -1.1),
        (Vec3::new(-0.05, 0.50, -0.35), 2.4),
    ];
    for (eye, roll) in views {
        assert_pose_is_recovered(&format!("roll {roll}"), camera(eye, roll), 1);
    }
}

#[test]
fn a_sheet_out_of_focus_does_not_look_farther_away() {
    assert_pose_is_recovered("four pixels of blur", camera(Vec3::new(-0.25, 0.55, 0.40), 0.4), 4);
}

/// Top-left corners of the black cells of a sheet, in millimeters on the page.
fn black_cells(svg: &str) -> Vec<DVec2> {
    let path = svg.split_once("<path d=\"").and_then(|(_, rest)| rest.split_once('"')).expect("a path of cells").0;
    let cells = path.split('M').filter(|cell| !cell.is_empty());
    cells
        .map(|cell| {
            let (x, y) = cell.split_once('h').and_then(|(at, _)| at.split_once(' ')).expect("a position");
            DVec2::new(x.parse().expect("a number"), y.parse().expect("a number"))
        })
        .collect()
}

#[test]
fn a_printed_sheet_has_the_black_cells_the_detector_reads_in_the_middle_of_the_page() {
    /// Positions are written with three digits.
    const ROUNDING: f64 = 1e-3;
    let svg = marker_sheet_svg(0, SIZE).expect("fits the page");
    let cell = 1000.0 * f64::from(CELL);
    let half = 0.5 * SHEET_CELLS as f64;
    let mut printed = vec![vec![true; SHEET_CELLS]; SHEET_CELLS];
    for corner in black_cells(&svg) {
        let at = (corner - DVec2::new(105.0, 148.5)) / cell + half;
        assert!((at - at.round()).abs().max_element() * cell < ROUNDING, "a cell at {corner} mm");
        printed[at.y.round() as usize][at.x.round() as usize] = false;
    }
    assert_eq!(printed, cells());
}

#[test]
fn the_sheet_of_marker_0_is_the_one_in_the_repository() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/markers/tag36h11-0.svg");
    let svg = marker_sheet_svg(0, SIZE).expect("fits the page");
    if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
        fs::create_dir_all(path.parent().expect("a folder")).expect("a writable folder");
        fs::write(&path, &svg).expect("a writable file");
    }
    // Git may have checked the file out with the line ends of Windows.
    let committed = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(
        committed == svg,
        "assets/markers/tag36h11-0.svg differs from what marker_sheet_svg(0, {SIZE}) draws. If the new drawing is \
         right, run UPDATE_SNAPSHOTS=1 cargo test --test tracking print and commit the file"
    );
}

#[test]
fn sheets_that_cannot_be_printed_are_refused() {
    assert_eq!(marker_sheet_svg(587, SIZE), Err(TrackingError::NoSuchMarker(587.into())));
    assert_eq!(marker_sheet_svg(u32::MAX, SIZE), Err(TrackingError::NoSuchMarker(u32::MAX.into())));
    for size in [0.0, -0.1, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(marker_sheet_svg(0, size), Err(TrackingError::BadSize(size)));
    }
    assert!(matches!(marker_sheet_svg(0, f32::NAN), Err(TrackingError::BadSize(_))));
    // With its margin the sheet is a quarter wider than the black square; 5 mm stay free on both sides of an A4 page.
    assert!(marker_sheet_svg(586, 0.16).is_ok());
    assert_eq!(marker_sheet_svg(586, 0.161), Err(TrackingError::BadSize(0.161)));
}
