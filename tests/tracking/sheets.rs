//! Printed sheets, as the detector sees them from straight above: every marker is where its board says, in true size.

use bevy::{math::DVec2, prelude::*};
use bevy_mirrorball::tracking::{
    AprilTagDetector, BoardMarker, DetectedMarker, LumaView, MarkerAnchor, MarkerBoard, MarkerDetector, MarkerFamily,
    MarkerSheet, PaperSize, TrackingError,
};

/// Pixels of a millimeter of a sheet.
const PIXELS: f64 = 4.0;
/// Distance of a corner from its place in millimeters: a fifth of a pixel.
const MILLIMETERS: f64 = 0.05;

/// Numbers of an SVG attribute.
fn attribute(element: &str, name: &str) -> Option<String> {
    Some(element.split_once(&format!(" {name}=\""))?.1.split_once('"')?.0.to_owned())
}

/// Corners of all black cells of a sheet in millimeters on the page, and the size of the page.
fn black_cells(svg: &str) -> (Vec<[DVec2; 4]>, UVec2) {
    let size = |name| attribute(svg, name).and_then(|text| text.strip_suffix("mm")?.parse::<f64>().ok()).expect("mm");
    let page = PIXELS * DVec2::new(size("width"), size("height"));
    let mut cells = Vec::new();
    for path in svg.split("<path").skip(1) {
        let data = attribute(path, "d").expect("a path has data");
        for cell in data.split('z').filter(|cell| !cell.is_empty()) {
            let corner = |text: &str| {
                let (x, y) = text.split_once(' ').expect("two numbers");
                DVec2::new(x.parse().expect("a number"), y.parse().expect("a number"))
            };
            let corners: Vec<_> = cell.trim_start_matches('M').split('L').map(corner).collect();
            cells.push(corners.try_into().expect("four corners"));
        }
    }
    (cells, page.round().as_uvec2())
}

/// Markers on a sheet, with corners in millimeters. Lines and texts are left out.
fn read(svg: &str, family: MarkerFamily) -> Vec<DetectedMarker> {
    let (cells, size) = black_cells(svg);
    let mut luma = vec![230; size.element_product() as usize];
    for corners in cells {
        let low = corners.into_iter().reduce(DVec2::min).expect("four corners") * PIXELS;
        let high = corners.into_iter().reduce(DVec2::max).expect("four corners") * PIXELS;
        // A pixel is black if its center is in the cell. All cells of these sheets are upright.
        for y in (low.y + 0.5).floor() as u32..(high.y + 0.4).floor() as u32 {
            for x in (low.x + 0.5).floor() as u32..(high.x + 0.4).floor() as u32 {
                luma[(y * size.x + x) as usize] = 20;
            }
        }
    }
    let mut detector = AprilTagDetector::with_families(&[family]).expect("the AprilTag library of this crate");
    let mut found = detector.detect(LumaView::new(size, &luma).expect("as many pixels as the size says"), 2.0);
    for marker in &mut found {
        marker.corners = marker.corners.map(|corner| corner / PIXELS);
    }
    found.sort_by_key(|marker| marker.id);
    found
}

/// Compares the markers on a sheet with their places on the page, relative to the first.
fn assert_printed(sheet: &MarkerSheet, expected: &[(BoardMarker, f64)]) {
    let svg = sheet.to_svg().expect("fits");
    let found = read(&svg, expected[0].0.family);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    let center = |marker: &DetectedMarker| marker.corners.iter().sum::<DVec2>() / 4.0;
    for (marker, (wanted, quarters)) in found.iter().zip(expected) {
        assert_eq!(marker.marker(), wanted.marker());
        let place = Vec3::from(wanted.place.translation).xz().as_dvec2() * 1000.0;
        let half = 500.0 * f64::from(wanted.size);
        for (corner, (x, y)) in marker.corners.iter().zip([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]) {
            let turned = DVec2::from_angle(quarters * std::f64::consts::FRAC_PI_2).rotate(half * DVec2::new(x, y));
            let off = corner.distance(center(&found[0]) + place + turned);
            assert!(off < MILLIMETERS, "{}: a corner is off by {off} mm", marker.marker());
        }
    }
}

/// The markers of a flat board, that of the anchor first.
fn flat(anchor: &MarkerAnchor, board: &MarkerBoard) -> Vec<(BoardMarker, f64)> {
    let own = BoardMarker::new(anchor.marker(), anchor.size, Isometry3d::IDENTITY);
    [own].into_iter().chain(board.markers.iter().copied()).map(|marker| (marker, 0.0)).collect()
}

#[test]
fn every_family_is_printed_in_true_size() {
    for family in MarkerFamily::ALL {
        // Cells of whole pixels.
        let size = 0.01 * family.square_cells() as f32;
        let anchor = MarkerAnchor::new(family.marker_count() - 1, size).with_family(family);
        assert_printed(&MarkerSheet::new(&anchor), &flat(&anchor, &MarkerBoard::default()));
    }
}

#[test]
fn sheets_of_boards_have_their_markers_where_the_board_says() {
    let anchor = MarkerAnchor::new(0, 0.1);
    let board = MarkerBoard::around_ball(&anchor, Vec2::new(0.17, 0.01), 0.06);
    let sheet = MarkerSheet::new(&anchor).with_board(&board).with_ball(Vec2::new(0.17, 0.01), 0.06);
    assert_printed(&sheet.on(PaperSize::A3.landscape()), &flat(&anchor, &board));
    let anchor = MarkerAnchor::new(100, 0.04);
    let board = MarkerBoard::grid(&anchor, 3, 4, 0.06);
    assert_printed(&MarkerSheet::new(&anchor).with_board(&board), &flat(&anchor, &board));
}

#[test]
fn markers_of_a_net_have_their_tops_at_the_folds() {
    let anchor = MarkerAnchor::new(7, 0.04);
    let box_size = Vec3::new(0.08, 0.06, 0.07);
    // Below, right, above and left of the top, half of the top's and half of the side's length away.
    let faces = [(0.0, 0.065, 0.0), (0.07, 0.0, -1.0), (0.0, -0.065, 2.0), (-0.07, 0.0, 1.0)];
    let sides = (8..).zip(faces).map(|(id, (x, z, quarters))| (BoardMarker::beside(id, 0.04, x, z), quarters));
    let top = (BoardMarker::beside(7, 0.04, 0.0, 0.0), 0.0);
    assert_printed(&MarkerSheet::box_net(&anchor, box_size, 0.04), &[top].into_iter().chain(sides).collect::<Vec<_>>());
}

#[test]
fn sheets_say_what_is_on_them() {
    let anchor = MarkerAnchor::new(3, 0.1).with_family(MarkerFamily::TagStandard41h12);
    let sheet = MarkerSheet::new(&MarkerAnchor { size: 0.05, ..anchor }).with_ball(Vec2::new(0.1, 0.0), 0.05);
    let svg = sheet.on(PaperSize::A4.landscape()).to_svg().expect("fits");
    for text in ["tagStandard41h12 number 3, white square 50 mm", "diameter 100 mm", "This bar is 100 mm long", "297mm"]
    {
        assert!(svg.contains(text), "{text} is not in {svg}");
    }
    // Its outline, and the ring.
    let radii: Vec<_> = svg.split("<circle").skip(1).filter_map(|circle| attribute(circle, "r")).collect();
    assert_eq!(radii, ["50.000", "30.000"]);
}

#[test]
fn what_does_not_fit_is_refused_with_the_sizes() {
    let anchor = MarkerAnchor::new(0, 0.1);
    let ball = |paper| MarkerSheet::new(&anchor).with_ball(Vec2::new(0.17, 0.01), 0.05).on(paper).to_svg();
    assert!(ball(PaperSize::A4.landscape()).is_ok());
    let error = ball(PaperSize::A4).expect_err("too narrow").to_string();
    assert!(error.contains("293 ×") && error.contains("210 × 297 mm"), "{error}");
    let net = MarkerSheet::box_net(&anchor, Vec3::splat(0.1), 0.04).to_svg().expect_err("125 mm of print");
    assert_eq!(net, TrackingError::BoxTooSmall { marker: 0.into(), print: 125.0, side: 100.0 });
    let sides = MarkerBoard::box_sides(&anchor, Vec3::splat(0.2), 0.04);
    let error = MarkerSheet::new(&anchor).with_board(&sides).to_svg();
    assert_eq!(error, Err(TrackingError::NotInPlane(1.into())));
    assert_eq!(MarkerSheet::new(&MarkerAnchor::new(587, 0.1)).to_svg(), Err(TrackingError::NoSuchMarker(587.into())));
    let without_ball = MarkerSheet::new(&anchor).with_ball(Vec2::ZERO, f32::NAN).to_svg();
    assert!(matches!(without_ball, Err(TrackingError::BadSize(_))));
}

#[test]
fn the_dots_of_a_button_are_where_the_button_is() {
    let anchor = MarkerAnchor::new(20, 0.04);
    let (center, size) = (Vec2::new(0.02, 0.095), Vec2::new(0.056, 0.075));
    let svg = MarkerSheet::new(&anchor).with_button(center, size, "a < b").to_svg().expect("fits on A4");
    let marker = &read(&svg, MarkerFamily::Tag36h11)[0];
    let middle = marker.corners.iter().sum::<DVec2>() / 4.0;
    let number = |element: &str, name| attribute(element, name).and_then(|text| text.parse::<f64>().ok());
    let dot = |element: &str| Some(DVec2::new(number(element, "cx")?, number(element, "cy")?) - middle);
    let dots: Vec<DVec2> = svg.split("<circle").skip(1).filter_map(dot).collect();
    let mean = dots.iter().sum::<DVec2>() / dots.len() as f64;
    assert!(mean.distance(1000.0 * center.as_dvec2()) < MILLIMETERS, "{mean}");
    // All of them are in the field, and fill it.
    let reach = dots.iter().map(|dot| (*dot - mean).abs()).reduce(DVec2::max).expect("dots");
    assert!(reach.cmplt(500.0 * size.as_dvec2()).all() && reach.cmpgt(350.0 * size.as_dvec2()).all(), "{reach}");
    assert!(svg.contains(">a &lt; b</text>"));
    let empty = MarkerSheet::new(&anchor).with_button(center, Vec2::ZERO, "").to_svg();
    assert_eq!(empty, Err(TrackingError::BadSize(0.0)));
    let beside = MarkerSheet::new(&anchor).with_button(Vec2::new(0.3, 0.0), size, "").to_svg();
    assert!(matches!(beside, Err(TrackingError::DoesNotFit { .. })), "{beside:?}");
}
