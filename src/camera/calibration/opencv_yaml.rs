//! Calibrations of OpenCV and ROS. Both write YAML of one form: numbers at the top, matrices as blocks of `rows`,
//! `cols` and `data`. This reads that form and not YAML at large.

use crate::camera::{Distortion, Intrinsics};
use bevy::{
    math::{DVec2, UVec2},
    platform::collections::HashMap,
};

/// A field that is missing or wrong: its name, what was found, what is expected.
pub(super) struct Wrong(pub &'static str, pub String, pub &'static str);

/// From the center of the first pixel, where OpenCV and ROS have the origin, to its corner, where we have it.
const CENTER_OF_PIXEL: DVec2 = DVec2::splat(0.5);

/// Distortion models whose first five coefficients are ours, by the names that ROS gives them.
const KNOWN_MODELS: [&str; 2] = ["plumb_bob", "rational_polynomial"];

pub(super) fn read(text: &str) -> Result<Intrinsics, Wrong> {
    let fields = fields(text);
    let size = UVec2::new(edge(&fields, "image_width")?, edge(&fields, "image_height")?);
    let expected = "a matrix of 3 × 3 numbers: fx, 0, cx, 0, fy, cy, 0, 0, 1";
    let matrix = numbers(&fields, "camera_matrix.data", "camera_matrix", expected)?;
    let wrong = || Wrong("camera_matrix", format!("{matrix:?}"), expected);
    let [fx, skew, cx, _, fy, cy, ..] = *matrix.first_chunk::<9>().ok_or_else(wrong)?;
    if matrix.len() != 9 || skew.abs() > 1e-6 * fx.abs() {
        return Err(wrong());
    }
    if let Some(model) = fields.get("distortion_model").filter(|model| !KNOWN_MODELS.contains(&model.as_str())) {
        let expected = "plumb_bob; calibrate with that model";
        return Err(Wrong("distortion_model", model.clone(), expected));
    }
    let expected = "k1, k2, p1, p2, k3, and 0 for all others; calibrate without the rational, thin prism, tilted or \
                    fisheye models";
    let coefficients = numbers(&fields, "distortion_coefficients.data", "distortion_coefficients", expected)?;
    if coefficients.len() < 4 || coefficients.iter().skip(5).any(|coefficient| *coefficient != 0.0) {
        return Err(Wrong("distortion_coefficients", format!("{coefficients:?}"), expected));
    }
    let mut distortion = [0.0; 5];
    distortion.iter_mut().zip(&coefficients).for_each(|(ours, theirs)| *ours = *theirs as f32);
    Ok(Intrinsics {
        distortion: Distortion::from_coefficients(distortion),
        ..Intrinsics::new(DVec2::new(fx, fy).as_vec2(), (DVec2::new(cx, cy) + CENTER_OF_PIXEL).as_vec2(), size)
    })
}

/// Values by names in small letters; those in a block have its name before them: `camera_matrix.data`. Lists in
/// brackets may go over several lines, lists of dashes are joined.
fn fields(text: &str) -> HashMap<String, String> {
    let mut fields: HashMap<String, String> = HashMap::default();
    let (mut block, mut last) = (String::new(), String::new());
    for line in text.lines() {
        let line = line.split(" #").next().unwrap_or_default().trim_end();
        let content = line.trim_start();
        if content.is_empty() || content.starts_with(['%', '#']) || content == "---" || content == "..." {
            continue;
        }
        if let Some(open) = fields.get_mut(&last).filter(|value| value.starts_with('[') && !value.ends_with(']')) {
            open.push_str(content);
            continue;
        }
        if let Some(item) = content.strip_prefix("- ") {
            let list = fields.entry(last.clone()).or_default();
            list.push_str(if list.is_empty() { "" } else { "," });
            list.push_str(item);
            continue;
        }
        let Some((name, value)) = content.split_once(':') else {
            continue;
        };
        let (name, value) = (name.trim().to_ascii_lowercase(), value.trim().trim_matches(['"', '\'']).to_owned());
        let is_in_block = content.len() < line.len();
        last = if is_in_block { format!("{block}.{name}") } else { name.clone() };
        if !is_in_block {
            block = name;
        }
        fields.insert(last.clone(), value);
    }
    fields
}

fn found(value: Option<&String>) -> String {
    value.map_or_else(|| "missing".to_owned(), Clone::clone)
}

fn edge(fields: &HashMap<String, String>, name: &'static str) -> Result<u32, Wrong> {
    let value = fields.get(name);
    let edge = value.and_then(|value| value.parse().ok()).filter(|edge| *edge > 0);
    let expected = "the size of the frames that the camera was calibrated with, in pixels, above 0";
    edge.ok_or_else(|| Wrong(name, found(value), expected))
}

fn numbers(
    fields: &HashMap<String, String>,
    key: &str,
    field: &'static str,
    expected: &'static str,
) -> Result<Vec<f64>, Wrong> {
    let value = fields.get(key);
    let list = |value: &String| {
        let items = value.trim_matches(['[', ']']).split(',').map(str::trim).filter(|item| !item.is_empty());
        items.map(|item| item.parse().ok().filter(|number: &f64| number.is_finite())).collect::<Option<Vec<f64>>>()
    };
    value.and_then(list).ok_or_else(|| Wrong(field, found(value), expected))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::math::Vec2;

    const OPENCV: &str = "%YAML:1.0
---
calibration_time: \"Wed 08 Dec 2021 05:13:09\"
image_Width: 640
image_Height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 4.5e+02, 0., 317.7,
       0., 4.6e+02, 2.775e2, 0., 0.,
       1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ 0.12, -1.0,
       1.0e-04, -4.0e-04, 3. ]
";
    const ROS: &str = "image_width: 1280 # pixels
image_height: 720
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [900.5, 0.0, 639.5, 0.0, 901.5, 359.5, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data:
  - -0.3
  - 0.1
  - 0.001
  - 0.002
  - 0.0
projection_matrix:
  data: [1.0, 0.0]
";

    fn refused(text: &str) -> String {
        let Err(Wrong(field, found, expected)) = read(text) else { panic!("read: {text}") };
        format!("{field} is {found}, has to be {expected}")
    }

    fn good(text: &str) -> Intrinsics {
        read(text).unwrap_or_else(|Wrong(field, found, _)| panic!("{field} is {found}"))
    }

    #[test]
    fn files_of_opencv_and_ros_are_read() {
        let lens = good(OPENCV);
        assert_eq!((lens.focal, lens.center), (Vec2::new(450.0, 460.0), Vec2::new(318.2, 278.0)));
        assert_eq!(lens.size, UVec2::new(640, 480));
        assert_eq!(lens.distortion.coefficients(), [0.12, -1.0, 1e-4, -4e-4, 3.0]);
        let lens = good(ROS);
        assert_eq!((lens.focal, lens.center), (Vec2::new(900.5, 901.5), Vec2::new(640.0, 360.0)));
        assert_eq!(lens.distortion.coefficients(), [-0.3, 0.1, 0.001, 0.002, 0.0]);
    }

    #[test]
    fn what_is_not_our_model_is_named() {
        let fisheye = refused(&ROS.replace("plumb_bob", "equidistant"));
        assert!(fisheye.contains("equidistant") && fisheye.contains("plumb_bob"), "{fisheye}");
        let rational = refused(&OPENCV.replace(", 3. ]", ", 3., 0.5, 0, 0 ]"));
        assert!(rational.contains("distortion_coefficients") && rational.contains("0.5"), "{rational}");
        assert_eq!(good(&OPENCV.replace(", 3. ]", ", 3., 0., 0, 0 ]")), good(OPENCV));
        let sizeless = refused(&OPENCV.replace("image_Width: 640\n", ""));
        assert!(sizeless.contains("image_width is missing"), "{sizeless}");
        let nan = refused(&OPENCV.replace("4.5e+02", ".Nan"));
        assert!(nan.contains("camera_matrix"), "{nan}");
        assert!(refused("").contains("missing"));
    }
}
