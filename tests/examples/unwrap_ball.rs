//! The example `unwrap_ball`: formats of what it reads and writes, and its answers to bad input.

use crate::built_example::{self, scratch};
use bevy_mirrorball::environment_map::EquirectPixels;
use std::process::Output;

/// Runs the example on a gray ball of 100 pixels and a brightness, in a photograph with this name.
fn unwrap(photo: &str, brightness: f32, diameter: &str, out: &str) -> Option<Output> {
    let [photo, out] = [photo, out].map(scratch);
    let image = image::Rgb32FImage::from_pixel(160, 120, image::Rgb([brightness; 3]));
    match photo.extension().and_then(|extension| extension.to_str()) {
        Some("png") => image::DynamicImage::from(image).into_rgb8().save(&photo).expect("written"),
        _ => image.save(&photo).expect("written"),
    }
    let (photo, out) = (photo.to_string_lossy(), out.to_string_lossy());
    let ball = ["--center", "80,60", "--diameter", diameter, "--fov", "300", "--width", "32"];
    built_example::run("unwrap_ball", &[&["--photo", &*photo, "--out", &*out][..], &ball].concat())
}

#[test]
fn linear_photographs_stay_linear_and_unclipped() {
    for photo in ["gray_ball.hdr", "gray_ball.exr"] {
        let Some(output) = unwrap(photo, 32.0, "100", "from_linear.exr") else { return };
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let map = EquirectPixels::open(scratch("from_linear.exr")).expect("written");
        assert!(map.texels.iter().all(|texel| (*texel - 32.0).abs().max_element() < 0.1), "{photo}: {}", map.texels[9]);
    }
}

#[test]
fn extensions_are_known_in_any_case() {
    for out in ["map.PNG", "map.Hdr", "map.EXR"] {
        let Some(output) = unwrap("gray_ball.png", 0.5, "100", out) else { return };
        assert!(output.status.success(), "{out}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(scratch(out).exists(), "{out}");
    }
}

#[test]
fn a_ball_larger_than_its_picture_is_refused_with_the_numbers() {
    let Some(output) = unwrap("gray_ball.png", 0.5, "1600", "never.hdr") else { return };
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("1600 pixels") && said.contains("160 × 120"), "{said}");
}
