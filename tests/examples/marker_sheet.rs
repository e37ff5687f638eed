//! The example `marker_sheet`: the kinds of sheets, and its answers to bad input.

use crate::built_example::{self, scratch};
use std::fs;

#[test]
fn every_kind_is_written_and_what_does_not_fit_is_refused() {
    let out = scratch("sheet.svg");
    let path = out.to_string_lossy();
    let cases: [(&[&str], Result<&str, &str>); 10] = [
        (&["--kind", "marker"], Ok("tag36h11 number 0, black square 100 mm")),
        (&["--kind", "marker", "--family", "tagCircle21h7", "--id", "37"], Ok("white square 100 mm")),
        (&["--kind", "ball", "--paper", "A4-landscape"], Ok("diameter 100 mm")),
        (&["--kind", "board", "--paper", "A3-landscape"], Ok("numbers 1 to 6")),
        (&["--kind", "grid", "--size", "30", "--grid", "3,4,50"], Ok("numbers 0 to 11, black squares 30 mm")),
        (&["--kind", "box", "--paper", "Letter"], Ok("60 mm high")),
        (&["--kind", "mat", "--paper", "A4-landscape"], Ok("numbers 20 to 21, black squares 40 mm")),
        (&["--kind", "ball"], Err("210 × 297 mm")),
        (&["--kind", "cube"], Err("marker, ball, board, grid, box or mat")),
        (&["--kind", "marker", "--id", "587"], Err("numbers go from 0 to 586")),
    ];
    for (arguments, expected) in cases {
        let _ = fs::remove_file(&out);
        let Some(output) = built_example::run("marker_sheet", &[arguments, &["--out", &*path][..]].concat()) else {
            return;
        };
        let (said, written) = (String::from_utf8_lossy(&output.stderr), fs::read_to_string(&out));
        match (expected, written) {
            (Ok(text), Ok(svg)) => assert!(svg.contains(text), "{arguments:?}: {svg}"),
            (Err(text), Err(_)) => assert!(!output.status.success() && said.contains(text), "{arguments:?}: {said}"),
            (_, written) => panic!("{arguments:?}: {said} {}", written.is_ok()),
        }
    }
}
