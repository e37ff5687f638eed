//! Real photographs of a chessboard with markers in its white squares, from the tutorial of OpenCV, which comes with
//! what OpenCV made of them.
//!
//! This crate does not read such boards. The four outermost of the 24 inner corners are marked by hand in each
//! photograph; all are refined to where the edges of the squares meet.

use crate::shared_data;
use bevy::{
    math::{DMat2, DVec2},
    prelude::*,
};
use bevy_mirrorball::{
    camera::{
        FramePixels,
        calibration::{CalibrationPoint, CalibrationView, calibrate},
    },
    prelude::*,
};

/// Photographs, and in each the inner corners at the upper left, upper right, lower left and lower right of the sheet,
/// to some pixels.
const PHOTOGRAPHS: [(&str, [(f64, f64); 4]); 4] = [
    ("img_00.jpg", [(317.0, 80.0), (457.0, 129.0), (194.0, 281.0), (358.0, 357.0)]),
    ("img_01.jpg", [(249.0, 104.0), (391.0, 122.0), (184.0, 329.0), (366.0, 358.0)]),
    ("img_02.jpg", [(246.0, 109.0), (388.0, 113.0), (222.0, 334.0), (396.0, 340.0)]),
    ("img_03.jpg", [(194.0, 126.0), (340.0, 84.0), (281.0, 376.0), (450.0, 311.0)]),
];
/// Inner corners of the board.
const COLUMNS: u32 = 4;
const ROWS: u32 = 6;
/// Half the side in pixels of the window in which a corner is refined; markers begin 10 px from it.
const WINDOW: i32 = 5;

/// Place near `start` where the edges meet: all gradients around it are at right angles to the line to it (Förstner &
/// Gülch 1987).
fn refine(luma: &impl Fn(i32, i32) -> f64, start: DVec2) -> DVec2 {
    let mut corner = start;
    for _ in 0..30 {
        let (mut sum, mut moment) = (DMat2::ZERO, DVec2::ZERO);
        let middle = corner.floor().as_ivec2();
        for (x, y) in (-WINDOW..=WINDOW).flat_map(|y| (-WINDOW..=WINDOW).map(move |x| (middle.x + x, middle.y + y))) {
            let gradient = DVec2::new(luma(x + 1, y) - luma(x - 1, y), luma(x, y + 1) - luma(x, y - 1));
            let at = DVec2::new(f64::from(x), f64::from(y)) + 0.5;
            let weight = (-at.distance_squared(corner) / f64::from(WINDOW * WINDOW)).exp();
            let outer = DMat2::from_cols(gradient * gradient.x, gradient * gradient.y) * weight;
            sum += outer;
            moment += outer * at;
        }
        let next = sum.inverse() * moment;
        if next.distance(corner) < 1e-3 {
            return next;
        }
        corner = next;
    }
    corner
}

/// Projective interpolation between the four marked corners: exact for a plane, so only the lens is left to refine.
fn between([a, b, c, d]: [DVec2; 4], u: f64, v: f64) -> DVec2 {
    // Heckbert 1989: the unit square onto a quadrilateral.
    let (e, f, g) = (b - d, c - d, a - b + d - c);
    let area = e.perp_dot(f);
    let (p, q) = (g.perp_dot(f) / area, e.perp_dot(g) / area);
    (a * (1.0 - u - v) + b * ((1.0 + p) * u) + c * ((1.0 + q) * v)) / (1.0 + p * u + q * v)
}

fn view(frame: &FramePixels, marked: [(f64, f64); 4]) -> CalibrationView {
    let pixels = frame.luma8();
    let (width, height) = (frame.size.x as i32, frame.size.y as i32);
    let luma = |x: i32, y: i32| f64::from(pixels[(y.clamp(0, height - 1) * width + x.clamp(0, width - 1)) as usize]);
    let outer = marked.map(|corner| refine(&luma, corner.into()));
    let point = |i: u32| {
        let (column, row) = (f64::from(i % COLUMNS), f64::from(i / COLUMNS));
        let guess = between(outer, column / f64::from(COLUMNS - 1), row / f64::from(ROWS - 1));
        let frame = refine(&luma, guess);
        assert!(frame.distance(guess) < 4.0, "corner {column}, {row} is expected at {guess} and was found at {frame}");
        CalibrationPoint { board: DVec2::new(column, row) * 0.04, frame }
    };
    CalibrationView { points: (0..COLUMNS * ROWS).map(point).collect() }
}

#[test]
fn real_photographs_give_what_opencv_made_of_them() {
    let Some(folder) = shared_data::find("markers/opencv_aruco") else { return };
    let truth = Intrinsics::open(folder.join("tutorial_camera_charuco.yml")).expect("a file of OpenCV");
    let views =
        PHOTOGRAPHS.map(|(name, marked)| view(&FramePixels::open(folder.join(name)).expect("a photograph"), marked));
    let found = calibrate(truth.size, &views).expect("enough views");
    let focal = found.intrinsics.focal / truth.focal - 1.0;
    println!("{} of 4 usable; focal lengths differ by {focal}; {found:#?}", found.used_views());
    assert!(focal.abs().max_element() < 0.03, "focal lengths differ by {focal}");
    let shift = |lens: &Intrinsics, seen: Vec2| lens.undistort_pixel(seen).expect("in view") - seen;
    let seen = views.iter().flat_map(|view| &view.points).map(|point| point.frame.as_vec2());
    let off = seen.map(|seen| shift(&truth, seen).distance(shift(&found.intrinsics, seen))).fold(0.0, f32::max);
    println!("the distortions differ by {off} px");
    assert!(off < 1.0, "the distortions differ by {off} px");
    // OpenCV's own is 0.18.
    assert!(found.reprojection_error < 0.3, "{found:?}");
}
