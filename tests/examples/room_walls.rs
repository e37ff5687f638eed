//! The walls of `shadow_lab`: the shadows of a sign from all directions must not show as spots.

use crate::built_example::{self, scratch};
use bevy_mirrorball::camera::FramePixels;

/// Two parts of the walls that no car and no lamp's shadow reaches: columns and rows of pixels.
const WALLS: [(std::ops::Range<i32>, std::ops::Range<i32>); 2] = [(188..267, 38..70), (45..100, 50..75)];

/// Draws the room as it is after six frames, and returns its picture.
fn draw(name: &str, options: &[&str]) -> Option<FramePixels> {
    let out = scratch(name);
    let out_text = out.to_str().expect("the target folder has a printable name");
    let common = ["--headless", "--frames", "1", "--size", "320x180", "--out", out_text];
    let output = built_example::run("shadow_lab", &[&common, options].concat())?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(FramePixels::open(out.join("frame_0000.png")).expect("written"))
}

#[test]
fn walls_are_as_even_as_under_a_thousand_directions() {
    let Some(picture) = draw("lab", &[]) else { return };
    let Some(reference) = draw("lab_reference", &["--directions", "1024", "--samples", "full"]) else { return };
    for (columns, rows) in WALLS {
        let pixels = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        let steps = |(x, y): (i32, i32)| [0, 1, 2].map(|c| picture.rgb8(x, y)[c].abs_diff(reference.rgb8(x, y)[c]));
        let worst = pixels.flat_map(steps).max();
        println!("differs by at most {worst:?}/255");
        assert!(worst <= Some(2));
    }
}
