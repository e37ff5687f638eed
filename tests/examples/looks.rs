//! The example `looks`: its gallery, and files with the looks of things.

use crate::{
    built_example::{self, scratch},
    picture_writers::{open, places, run, text},
};
use bevy::math::{IVec2, UVec2};
use bevy_mirrorball::camera::FramePixels;

/// Number of strips of the gallery, in columns.
const STRIPS: i32 = 18;
const COLUMNS: i32 = 3;
/// Size of a strip, and distances from one to the next, of a desk drawn with 160 × 120 pixels.
const STRIP: UVec2 = UVec2::new(135, 80);
const CELL: IVec2 = IVec2::new(137, 89);
/// Upper left corner of the first strip, below its caption.
const CORNER: IVec2 = IVec2::new(2, 9);

/// Largest step between channels of two pixels.
fn step(one: [u8; 3], two: [u8; 3]) -> u8 {
    (0..3).map(|c| one[c].abs_diff(two[c])).max().unwrap_or(0)
}

fn differing(one: &FramePixels, two: &FramePixels) -> usize {
    places(one.size).filter(|(x, y)| one.rgb8(*x, *y) != two.rgb8(*x, *y)).count()
}

#[test]
fn the_gallery_has_another_look_in_each_strip_and_the_same_desk() {
    let out = scratch("looks.png");
    if run("looks", &["--headless", "--size", "160x120", "--out", text(&out)]).is_none() {
        return;
    }
    let gallery = open(&out);
    assert_eq!(gallery.size.as_ivec2(), IVec2::new(COLUMNS, STRIPS / COLUMNS) * CELL + 2);
    let pixel = |strip: i32, (x, y): (i32, i32)| {
        let at = CORNER + IVec2::new(strip % COLUMNS, strip / COLUMNS) * CELL + IVec2::new(x, y);
        gallery.rgb8(at.x, at.y)
    };
    let mut fewest = usize::MAX;
    for (one, two) in (0..STRIPS).flat_map(|one| (0..one).map(move |two| (one, two))) {
        let steps = places(STRIP).map(|at| step(pixel(one, at), pixel(two, at)));
        let changed = steps.filter(|step| *step > 8).count();
        fewest = fewest.min(changed);
        assert!(changed > 60, "the looks {two} and {one} differ in {changed} pixels");
    }
    // The ball and the marker, which nothing virtual covers.
    let desk = places(UVec2::new(90, 28)).map(|at| (1..STRIPS).map(|i| step(pixel(0, at), pixel(i, at))).max());
    let worst = desk.flatten().max();
    println!("looks differ in {fewest} pixels and more, the desk by {worst:?}/255");
    assert!(worst <= Some(4), "the desk differs by {worst:?}/255");
}

/// Size of the four parts of the picture that `--compare` draws of a desk of 320 × 240 pixels, in two columns and rows.
const PART: UVec2 = UVec2::new(150, 127);
/// Middle and radius of the ball in each part, within its outline.
const BALL: [i32; 3] = [78, 31, 18];

#[test]
fn sphere_map_and_cube_map_look_alike_and_filters_blur_the_ball() {
    let out = scratch("looks_filters.png");
    if run("looks", &["--compare", "--size", "320x240", "--out", text(&out)]).is_none() {
        return;
    }
    let sheet = open(&out);
    let cell = (sheet.size - 2) / 2;
    assert!(cell.cmpge(PART).all(), "{cell}");
    let pixel = |part: u32, x: i32, y: i32| {
        let corner = (UVec2::new(part % 2, part / 2) * cell + UVec2::new(2, 2 + cell.y - 2 - PART.y)).as_ivec2();
        sheet.rgb8(corner.x + x, corner.y + y).map(i32::from)
    };
    let [x, y, radius] = BALL;
    let ball =
        |part: u32| (-radius..radius).flat_map(move |dy| (-radius..radius).map(move |dx| (part, x + dx, y + dy)));
    // Detail: what a pixel differs from the mean of its neighbors on both sides by.
    let detail = |part: u32| -> i32 {
        let [left, middle, right] = [-1, 0, 1].map(|step| move |(part, x, y)| pixel(part, x + step, y)[1]);
        ball(part).map(|at| (2 * middle(at) - left(at) - right(at)).abs()).sum()
    };
    let details = [0, 1, 2, 3].map(detail);
    let teapot = |part: u32| {
        let places = (60..110).flat_map(|y| (20..80).map(move |x| (x, y)));
        places.map(|(x, y)| pixel(part, x, y).iter().sum::<i32>()).sum::<i32>() as f32 / (50 * 60 * 3) as f32
    };
    let brightness = [0, 1, 2, 3].map(teapot);
    println!("detail of the balls {details:?}, brightness of the teapots {brightness:?}");
    assert_eq!(details[0], details[1], "both show the real ball");
    assert!(details[2..].iter().all(|filtered| 2 * filtered < details[0]), "{details:?}");
    // Maps and filters differ in detail, not in how bright things are.
    assert!((brightness[0] - brightness[1]).abs() < 12.0 && (brightness[2] - brightness[3]).abs() < 20.0);
    let [one, two] = [0, 1].map(|part| places(PART).map(move |(x, y)| (part, x, y)));
    let differing = one.zip(two).filter(|(one, two)| pixel(one.0, one.1, one.2) != pixel(two.0, two.1, two.2)).count();
    assert!(differing > 500, "{differing} pixels differ between sphere map and cube map");
}

/// Every kind of style, and values that are no defaults. What is left out has its default.
const STYLES: &str = r#"{
    "teapot": (style: Classic((model: Mixed((base: 0.25, mirror: 0.5)), fresnel: Some(0.125)))),
    "fox": (
        style: Toon((
            model: Phong((diffuse: 1.5, exponent: 7.0)),
            key: Direction((0.5, 1.0, -0.25)),
            bands: 5,
            outline_color: LinearRgba((red: 1.0, green: 0.0, blue: 0.0, alpha: 1.0)),
        )),
        ramps: (specular: Some(Ring)),
    ),
    "block": (style: Engine, measured_light: (0.5)),
}"#;

#[test]
fn saved_looks_read_back_equal_and_look_the_same() {
    let [written, first, second] = ["looks_written.ron", "looks_first.ron", "looks_second.ron"].map(scratch);
    std::fs::write(&written, STYLES).expect("written");
    let mut pictures = Vec::new();
    for (from, to) in [(&written, &first), (&first, &second)] {
        let out = to.with_extension("png");
        let arguments = ["--headless", "--size", "128x96", "--styles", text(from), "--save", text(to), "--out"];
        if run("looks", &[&arguments[..], &[text(&out)]].concat()).is_none() {
            return;
        }
        pictures.push(open(&out));
    }
    let [first, second] = [first, second].map(|file| std::fs::read_to_string(file).expect("written"));
    assert_eq!(first, second);
    for kept in [
        "base: 0.25",
        "diffuse: 0.7",
        "fresnel: Some(0.125)",
        "exponent: 7.0",
        "Direction((0.5, 1.0, -0.25))",
        "bands: 5",
        "red: 1.0",
        "outline_width: 2.0",
        "specular: Some(Ring)",
        "Engine",
        "measured_light: (0.5)",
        "measured_light: (1.0)",
    ] {
        assert!(first.contains(kept), "{kept} is not in {first}");
    }
    assert_eq!(differing(&pictures[0], &pictures[1]), 0, "equal looks differ");

    let out = scratch("looks_image_based.png");
    let plain = ["--headless", "--size", "128x96", "--style", "image-based", "--out", text(&out)];
    if run("looks", &plain).is_some() {
        let changed = differing(&pictures[0], &open(&out));
        println!("the file changes {changed} pixels");
        assert!(changed > 300, "the file changes {changed} pixels only");
    }
}

#[test]
fn wrong_files_and_options_are_answered_with_what_to_do() {
    let files = [
        ("looks_cut.ron", r#"{"fox": (style: Toon("#, &["looks_cut.ron", "1:", "--save"][..]),
        (
            "looks_field.ron",
            "{\n\"fox\": (style: Toon((bandz: 3)))}",
            &["looks_field.ron", "2:", "bandz", "bands", "--save"],
        ),
        ("looks_style.ron", r#"{"fox": (style: Crayon)}"#, &["looks_style.ron", "Crayon", "ImageBased", "--save"]),
        ("looks_thing.ron", r#"{"dog": (style: Engine)}"#, &["looks_thing.ron", "dog", "teapot, fox, block"]),
        ("looks_more.ron", r#"{"fox": (style: Engine)} 5"#, &["looks_more.ron", "1:", "railing"]),
    ];
    for (name, content, expected) in files {
        let file = scratch(name);
        std::fs::write(&file, content).expect("written");
        is_refused(&["--styles", text(&file)], expected);
    }
    is_refused(&["--styles", "nowhere.ron"], &["nowhere.ron", "--save"]);
    is_refused(&["--style", "crayon"], &["crayon", "image-based", "ink"]);
    is_refused(&["--style", "ink", "--styles", "a.ron"], &["--style", "--styles"]);
    is_refused(&["--style", "ink", "--compare"], &["--style", "--compare"]);
    is_refused(&["--size", "640"], &["WIDTHxHEIGHT", "640"]);
}

fn is_refused(arguments: &[&str], expected: &[&str]) {
    let Some(output) = built_example::run("looks", &[arguments, &["--headless"]].concat()) else { return };
    let said = String::from_utf8_lossy(&output.stderr);
    println!("{said}");
    assert!(!output.status.success(), "{arguments:?}");
    assert!(expected.iter().all(|part| said.contains(part)), "{arguments:?}: {said}");
}
