//! The detector in pure Rust: in place of the C library it finds the same markers.

use crate::desk_clip::camera_is_found;
use bevy::math::{DVec2, UVec2};
use bevy_mirrorball::{
    camera::FramePixels,
    tracking::{
        AprilTagDetector, DetectedMarker, LocusDetector, LumaView, MarkerDetection, MarkerDetector, MarkerFamily,
        TrackingError, marker_cells,
    },
};

/// Largest distance of corners from those of the C library, in pixels, and in half of the images. In sRGB-encoded
/// images the corners of the C library are further inside the marker.
const PIXELS: (f64, f64) = (1.0, 0.6);

/// Finds the markers in an image, at half its resolution.
fn detect(detector: &mut dyn MarkerDetector, size: UVec2, luma: &[u8], decimation: f32) -> Vec<DetectedMarker> {
    detector.detect(LumaView::new(size, luma).expect("as many pixels as the size says"), decimation)
}

#[test]
fn the_camera_is_found_as_with_the_c_library() {
    camera_is_found(Some(MarkerDetection::new(LocusDetector::new())));
}

#[test]
fn corners_are_those_of_the_c_library_in_its_order() {
    let mut c = AprilTagDetector::new().expect("the AprilTag library of this crate");
    let mut rust = LocusDetector::new();
    let mut distances = Vec::new();
    for frame in 0..60 {
        let frame = FramePixels::open(format!("assets/desk_clip/frame_{frame:03}.jpg")).expect("shipped");
        let luma = frame.luma8();
        for decimation in [1.0, 2.0] {
            let [c, rust] = [&mut c as &mut dyn MarkerDetector, &mut rust]
                .map(|detector| detect(detector, frame.size, &luma, decimation));
            assert_eq!((c.len(), rust.len()), (1, 1), "there is one marker");
            assert_eq!(c[0].marker(), rust[0].marker());
            let corners = c[0].corners.iter().zip(&rust[0].corners);
            distances.push(corners.map(|(c, rust)| c.distance(*rust)).fold(0.0, f64::max));
        }
    }
    distances.sort_by(f64::total_cmp);
    let (worst, median) = (distances[distances.len() - 1], distances[distances.len() / 2]);
    println!("worst and median: {worst:.2} and {median:.2} px");
    assert!(worst < PIXELS.0 && median < PIXELS.1, "{worst} and {median} px");
}

#[test]
fn a_turned_marker_is_read_from_its_own_top_left_corner() {
    const CELL: u32 = 12;
    let cells = marker_cells(23).expect("exists");
    let count = cells.len() as u32;
    let edge = (count + 4) * CELL;
    for turns in 0..4 {
        let luma: Vec<u8> = (0..edge * edge)
            .map(|i| {
                let (mut x, mut y) = ((i % edge / CELL).wrapping_sub(2), (i / edge / CELL).wrapping_sub(2));
                for _ in 0..turns {
                    (x, y) = (y, count.wrapping_sub(1).wrapping_sub(x));
                }
                let cell = cells.get(y as usize).and_then(|row| row.get(x as usize));
                if cell.copied().unwrap_or(true) { 230 } else { 20 }
            })
            .collect();
        let [c, rust] = [
            &mut AprilTagDetector::new().expect("the AprilTag library of this crate") as &mut dyn MarkerDetector,
            &mut LocusDetector::new(),
        ]
        .map(|detector| detect(detector, UVec2::splat(edge), &luma, 1.0));
        assert_eq!((c.len(), rust.len(), rust[0].id), (1, 1, 23), "{turns} quarter turns");
        for (c, rust) in c[0].corners.iter().zip(&rust[0].corners) {
            assert!(c.distance(*rust) < PIXELS.0, "{turns} quarter turns: {c} and {rust}");
        }
        assert!(rust[0].corners.iter().all(|corner| corner.cmpge(DVec2::ZERO).all()));
    }
}

#[test]
fn images_of_any_size_and_without_markers_have_none() {
    let mut detector = LocusDetector::new();
    for size in [UVec2::ONE, UVec2::new(1, 300), UVec2::new(100, 3), UVec2::splat(16), UVec2::new(17, 33)] {
        let luma = vec![90; size.element_product() as usize];
        for decimation in [1.0, 2.0, f32::NAN] {
            assert!(detect(&mut detector, size, &luma, decimation).is_empty(), "{size}");
        }
    }
    // A checkerboard, and what a generator of numbers gives.
    let size = UVec2::new(320, 240);
    let mut state = 1_u32;
    let noise = (0..size.element_product()).map(|i| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let check = if (i % size.x / 9 + i / size.x / 9).is_multiple_of(2) { 40 } else { 190 };
        check + (state >> 26) as u8
    });
    let luma: Vec<u8> = noise.collect();
    assert!(detect(&mut detector, size, &luma, 1.0).is_empty() && detect(&mut detector, size, &luma, 2.0).is_empty());
}

#[test]
fn it_knows_one_family_and_says_so() {
    let mut detector = LocusDetector::new();
    assert_eq!(detector.set_families(&[MarkerFamily::Tag36h11]), Ok(()));
    let error = detector.set_families(&[MarkerFamily::Tag36h11, MarkerFamily::Tag25h9]).expect_err("not that one");
    assert_eq!(error, TrackingError::UnknownToDetector(MarkerFamily::Tag25h9));
    assert!(error.to_string().contains("tag25h9") && error.to_string().contains("apriltag"), "{error}");
    let pattern = detector.pattern(7.into()).expect("exists");
    assert_eq!(Some(pattern.cells), marker_cells(7));
}
