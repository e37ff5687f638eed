//! The example `calibrate`: the board to print, and its answers to views that tell nothing.

use crate::built_example::{self, scratch};

#[test]
fn the_board_is_written_as_a_page() {
    let path = scratch("board.svg");
    let arguments = ["--board", &path.to_string_lossy(), "--grid", "4x3", "--size", "40", "--first", "7"];
    let Some(output) = built_example::run("calibrate", &arguments) else { return };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let sheet = std::fs::read_to_string(path).expect("written");
    assert!(sheet.starts_with("<svg") && sheet.contains("numbers 7 to 18, black squares 40.0 mm"));
}

#[test]
fn bad_input_is_answered_with_what_to_do() {
    let gray = image::GrayImage::from_pixel(64, 48, image::Luma([90]));
    let (view, small) = (scratch("calibrate_view_1.png"), scratch("calibrate_small.png"));
    gray.save(&view).expect("written");
    image::imageops::thumbnail(&gray, 32, 24).save(&small).expect("written");
    let (pattern, nothing) = (scratch("calibrate_view_*.png"), scratch("calibrate_never_*.png"));
    let [view, small, pattern, nothing] = [&view, &small, &pattern, &nothing].map(|path| path.to_string_lossy());
    let cases: [(&[&str], &[&str]); 7] = [
        (&[], &["--board", "--images", "--device"]),
        (&["--images", &pattern], &["0 of 1 views", "3 are needed"]),
        (&["--images", &nothing], &["--images"]),
        (&["--images", &view, &small], &["64 × 48", "32 × 24"]),
        (&["--images", "nowhere.png"], &["nowhere.png"]),
        (&["--board", &view, "--size", "60"], &["435 × 585 mm", "A4"]),
        (&["--grid", "6"], &["6x8"]),
    ];
    for (arguments, expected) in cases {
        let Some(output) = built_example::run("calibrate", arguments) else { return };
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(expected.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
    }
}
