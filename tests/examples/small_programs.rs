//! The small examples without a window: each draws a frame, and the frame shows what the example is about.

use crate::{
    built_example::{self, scratch},
    picture_writers::{open, places, run, text},
};
use bevy::math::{IVec2, UVec2, Vec3};
use bevy_mirrorball::camera::{FramePixels, srgb_to_linear};

const SIZE: UVec2 = UVec2::new(320, 240);
/// Step in a channel from which on a pixel shows something else than the photograph.
const CHANGE: u8 = 30;
/// Step up to which it shows the same; half the size, so rounding adds up.
const NO_CHANGE: u8 = 2;

/// Draws a frame of an example, and returns it with what was printed. `None` where the example cannot run.
fn draw(name: &str, file: &str, more: &[&str]) -> Option<(FramePixels, String)> {
    let out = scratch(file);
    let _ = std::fs::remove_file(&out);
    let said = run(name, &[&["--headless", "--size", "320x240", "--out", text(&out)], more].concat())?;
    let frame = open(&out);
    assert_eq!(frame.size, SIZE);
    Some((frame, said))
}

/// A frame of the camera at the drawn size: the mean of each four pixels in linear light.
struct Halved(FramePixels);

impl Halved {
    fn open(path: &str) -> Self {
        Self(FramePixels::open(path).expect("shipped"))
    }

    /// Largest step of a channel from this frame to a drawn one.
    fn step(&self, drawn: &FramePixels, at: IVec2) -> u8 {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| self.0.rgb8(2 * at.x + x, 2 * at.y + y));
        let encoded = |linear: f32| {
            let steps = 0..=255;
            steps.min_by_key(|byte| ((srgb_to_linear(*byte) - linear).abs() * 1e6) as u32).unwrap_or(255)
        };
        let channel = |c: usize| encoded(four.iter().map(|rgb| srgb_to_linear(rgb[c])).sum::<f32>() / 4.0);
        (0..3).map(|c| channel(c).abs_diff(drawn.rgb8(at.x, at.y)[c])).max().unwrap_or(0)
    }

    /// Number of pixels of a rectangle that show something else.
    fn changed(&self, drawn: &FramePixels, corner: IVec2, size: UVec2) -> usize {
        places(size).filter(|(x, y)| self.step(drawn, corner + IVec2::new(*x, *y)) > CHANGE).count()
    }

    /// Checks that something virtual stands in each rectangle, that it is lit, and that the corners of the frame are
    /// those of the photograph.
    fn check(&self, drawn: &FramePixels, things: &[IVec2]) {
        for middle in things {
            let corner = *middle - 8;
            let changed = self.changed(drawn, corner, UVec2::splat(16));
            let light = places(UVec2::splat(16)).map(|(x, y)| drawn.linear(corner.x + x, corner.y + y)).sum::<Vec3>();
            println!("at {middle}: {changed} of 256 pixels changed, mean {}", light / 256.0);
            assert!(changed > 128, "nothing virtual at {middle}: {changed} of 256 pixels have changed");
            assert!(light.max_element() / 256.0 > 0.02, "what stands at {middle} is black: {light}");
        }
        for corner in [IVec2::new(2, 2), IVec2::new(300, 10), IVec2::new(10, 230), IVec2::new(310, 235)] {
            let step = self.step(drawn, corner);
            assert!(step <= NO_CHANGE, "the photograph has changed by {step} at {corner}");
        }
    }
}

const PHOTO: &str = "assets/desk/photo.jpg";

#[test]
fn minimal_shows_its_things_and_leaves_the_desk() {
    let Some((frame, _)) = draw("minimal", "minimal.png", &[]) else { return };
    Halved::open(PHOTO).check(&frame, &[IVec2::new(204, 126), IVec2::new(130, 150)]);
}

#[test]
fn toon_has_few_colors_and_its_key_changes_the_style() {
    let styles = [("none", None), ("toon", Some("KeyT"))];
    let mut frames = Vec::new();
    for (style, key) in styles {
        let press = key.map_or_else(Vec::new, |key| vec!["--press", key]);
        let Some((frame, _)) = draw("toon", &format!("toon_{style}.png"), &press) else { return };
        Halved::open(PHOTO).check(&frame, &[IVec2::new(204, 126)]);
        frames.push(frame);
    }
    // Inside the sphere.
    let (corner, size) = (IVec2::new(198, 117), UVec2::splat(12));
    let colors = |frame: &FramePixels| {
        let mut all: Vec<_> = places(size).map(|(x, y)| frame.rgb8(corner.x + x, corner.y + y)).collect();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    let differ = places(SIZE).filter(|(x, y)| frames[0].rgb8(*x, *y) != frames[1].rgb8(*x, *y)).count();
    let [smooth, drawn] = [&frames[0], &frames[1]].map(colors);
    println!("{differ} pixels differ; {smooth} colors in the sphere, {drawn} as toon");
    assert!(differ > 500, "the key changes nothing: {differ} pixels");
    assert!(4 * drawn < smooth, "{smooth} colors in the sphere, {drawn} as toon");
}

#[test]
fn no_ball_says_whose_light_it_is_and_nothing_is_black() {
    let Some((frame, said)) = draw("no_ball", "no_ball.png", &[]) else { return };
    assert!(said.contains("light: FittedSky"), "{said}");
    Halved::open(PHOTO).check(&frame, &[IVec2::new(204, 126), IVec2::new(130, 150)]);
}

#[test]
fn two_markers_has_the_second_one_where_the_sheet_lies() {
    let Some((frame, said)) = draw("two_markers", "two_markers.png", &[]) else { return };
    // From scripts/make_two_markers.py.
    let truth = Vec3::new(-0.04, 0.0, -0.19);
    let line = said.lines().rfind(|line| line.starts_with("number 1: Tracked at")).expect("it is tracked");
    let numbers = line.split(['[', ']', ',']).filter_map(|part| part.trim().parse().ok());
    let place = Vec3::from_slice(&numbers.collect::<Vec<f32>>());
    println!("the second marker is at {place}, off by {:.1} mm", 1000.0 * place.distance(truth));
    assert!(place.distance(truth) < 0.003, "at {place}, and the sheet lies at {truth}");
    Halved::open("assets/desk/two_markers.jpg").check(&frame, &[IVec2::new(153, 177), IVec2::new(151, 126)]);
}

#[test]
fn real_light_events_come_with_arrows() {
    let Some((frame, said)) = draw("real_light_events", "real_light_events.png", &["--frames", "4"]) else { return };
    assert!(said.contains("light 1 appeared"), "{said}");
    // The last of four frames of the clip.
    let clip = Halved::open("assets/desk_clip/frame_003.jpg");
    let changed = clip.changed(&frame, IVec2::ZERO, SIZE);
    println!("{changed} pixels of arrows; {said}");
    assert!((20..4000).contains(&changed), "{changed} pixels have changed");
}

#[cfg(feature = "webcam")]
#[test]
fn webcam_says_what_is_missing() {
    let out = scratch("webcam.png");
    let arguments = ["--headless", "--frames", "4", "--size", "64x48", "--out", text(&out)];
    let Some(output) = built_example::run("webcam", &arguments) else { return };
    let said = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success() && !said.contains("panicked"), "{said}");
    // Whether or not this machine has a camera.
    assert!(
        said.contains(": feed: ") && said.contains("Warning: marker: ") | said.contains("Missing: marker: "),
        "{said}"
    );
}

#[test]
fn wrong_options_are_answered_with_what_to_do() {
    for (arguments, expected) in [
        (&["--frames", "0"][..], "--frames takes a whole number above 0"),
        (&["--size", "640"], "640x480"),
        (&["--press", "T"], "KeyT"),
        (&["--scene", "a.glb"], "--scene"),
    ] {
        let Some(output) = built_example::run("minimal", arguments) else { return };
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() && said.contains(expected), "{arguments:?}: {said}");
    }
}
