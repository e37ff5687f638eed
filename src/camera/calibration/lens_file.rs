//! Files with the intrinsics of a lens.

use super::{CalibrationError, opencv_yaml};
use crate::camera::{Distortion, Intrinsics};
use bevy::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Intrinsics in a JSON file: `"intrinsics"` of a clip's sidecar and of the file that calibration writes.
#[derive(Serialize, Deserialize)]
pub(in crate::camera) struct IntrinsicsFields {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    #[serde(default)]
    k1: f32,
    #[serde(default)]
    k2: f32,
    #[serde(default)]
    p1: f32,
    #[serde(default)]
    p2: f32,
    #[serde(default)]
    k3: f32,
}

impl IntrinsicsFields {
    pub(in crate::camera) fn for_size(&self, size: UVec2) -> Intrinsics {
        let Self { fx, fy, cx, cy, k1, k2, p1, p2, k3 } = *self;
        Intrinsics {
            distortion: Distortion { k1, k2, p1, p2, k3 },
            ..Intrinsics::new(Vec2::new(fx, fy), Vec2::new(cx, cy), size)
        }
    }
}

impl From<Intrinsics> for IntrinsicsFields {
    fn from(Intrinsics { focal, center, distortion, .. }: Intrinsics) -> Self {
        let Distortion { k1, k2, p1, p2, k3 } = distortion;
        Self { fx: focal.x, fy: focal.y, cx: center.x, cy: center.y, k1, k2, p1, p2, k3 }
    }
}

/// The file that calibration writes.
#[derive(Serialize, Deserialize)]
pub(super) struct LensFile {
    pub image: [u32; 2],
    pub intrinsics: IntrinsicsFields,
    #[serde(default)]
    pub reprojection_error: f32,
    #[serde(default)]
    pub coverage: f32,
    #[serde(default)]
    pub views: usize,
}

impl Intrinsics {
    /// Reads the intrinsics of a lens with their distortion.
    ///
    /// The file is what [`Calibration::save`](super::Calibration::save) writes, YAML of OpenCV (`%YAML:1.0` with
    /// `camera_matrix` and `distortion_coefficients`) or the YAML of ROS with the model `plumb_bob`. Ours is JSON like
    /// the sidecar of a clip, which can be read too:
    ///
    /// ```json
    /// {
    ///     "image": [640, 480],
    ///     "intrinsics": {
    ///         "fx": 601.8, "fy": 601.5, "cx": 318.2, "cy": 243.9,
    ///         "k1": -0.25, "k2": 0.06, "p1": 0.0004, "p2": -0.0002, "k3": 0.0
    ///     }
    /// }
    /// ```
    /// `image` is the size in pixels that the intrinsics belong to. Its principal point counts from the corner of the
    /// first pixel, those of OpenCV and ROS from its center; they are shifted by half a pixel.
    ///
    /// # Errors
    /// [`CalibrationError::File`], [`CalibrationError::Json`] or [`CalibrationError::Value`] name the file, the field
    /// and the remedy.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, CalibrationError> {
        let path = path.as_ref();
        let text =
            std::fs::read_to_string(path).map_err(|source| CalibrationError::File { path: path.to_owned(), source })?;
        let wrong = |field, found, expected| CalibrationError::Value { path: path.to_owned(), field, found, expected };
        let lens = if text.trim_start().starts_with('{') {
            let file: LensFile = serde_json::from_str(&text)
                .map_err(|source| CalibrationError::Json { path: path.to_owned(), source })?;
            file.intrinsics.for_size(file.image.into())
        } else {
            opencv_yaml::read(&text)
                .map_err(|opencv_yaml::Wrong(field, found, expected)| wrong(field, found, expected))?
        };
        if lens.size.min_element() == 0 {
            return Err(wrong("image", lens.size.to_string(), "width and height in pixels, above 0"));
        }
        if !lens.is_valid() {
            let found = format!("fx {}, fy {}, cx {}, cy {}", lens.focal.x, lens.focal.y, lens.center.x, lens.center.y);
            return Err(wrong("intrinsics", found, "finite numbers in pixels, with focal lengths above 0"));
        }
        Ok(lens)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, text: &str) -> Result<Intrinsics, CalibrationError> {
        let path = std::env::temp_dir().join(format!("mirrorball_lens_file_{}_{name}", std::process::id()));
        std::fs::write(&path, text).expect("a writable folder");
        let lens = Intrinsics::open(&path);
        std::fs::remove_file(&path).expect("written above");
        lens
    }

    #[test]
    fn distortion_is_optional() {
        let plain = r#"{"image": [640, 480], "fps": 15, "intrinsics": {"fx": 600, "fy": 601, "cx": 320, "cy": 240}}"#;
        let lens = open("plain.json", plain).expect("complete");
        assert_eq!(lens, Intrinsics::new(Vec2::new(600.0, 601.0), Vec2::new(320.0, 240.0), UVec2::new(640, 480)));
        let distorted = open("distorted.json", &plain.replace("240}", r#"240, "k1": -0.25, "p2": 0.5}"#));
        let Distortion { k1, p2, .. } = distorted.expect("complete").distortion;
        assert_eq!((k1, p2), (-0.25, 0.5));
    }

    #[test]
    fn faulty_files_are_named_with_field_and_remedy() {
        let missing = r#"{"image": [640, 480], "intrinsics": {"fx": 600, "fy": 601, "cx": 320}}"#;
        let said = open("missing.json", missing).expect_err("no cy").to_string();
        assert!(said.contains("missing.json") && said.contains("`cy`") && said.contains("\"k1\""), "{said}");
        let negative = r#"{"image": [640, 480], "intrinsics": {"fx": -600, "fy": 601, "cx": 320, "cy": 240}}"#;
        let said = open("negative.json", negative).expect_err("negative").to_string();
        assert!(said.contains("fx -600") && said.contains("above 0"), "{said}");
        let empty = negative.replace("640", "0");
        assert!(open("empty.json", &empty).expect_err("no width").to_string().contains("\"image\""));
        let said = open("nothing.yml", "%YAML:1.0\n").expect_err("empty").to_string();
        assert!(said.contains("nothing.yml") && said.contains("image_width"), "{said}");
        assert!(matches!(Intrinsics::open("no such file"), Err(CalibrationError::File { .. })));
    }
}
