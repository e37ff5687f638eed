//! Files of environments: equirectangular images in Radiance (`.hdr`) and OpenEXR (`.exr`) format.
//!
//! Both formats hold linear radiance, Radiance with 8 bits and a common exponent (1 % steps), OpenEXR as 32-bit
//! floats. The [layout](EquirectPixels) is that of the image in memory. Many programs put −Z into the center of the
//! image instead of its left edge. Rotate such an image by `Quat::from_rotation_y(PI)` when it becomes a cube.
//!
//! OpenEXR files may have the channels of a layer (`ViewLayer.Combined.R`), small letters, or gray alone (`Y`). The
//! image is the display window: overscan is left out, and what the data window lacks is black.

use super::EquirectPixels;
use crate::image_files::{clean_radiance, is_linear, open_linear};
use bevy::prelude::*;
use image::{ImageError, ImageFormat, Rgb32FImage};
use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};

/// Error on reading or writing a file of an environment.
#[derive(thiserror::Error, Debug)]
#[non_exhaustive]
pub enum EnvironmentFileError {
    /// The extension of the file's name is not that of a known format.
    #[error("{0} is of an unknown format; name it .hdr (Radiance) or .exr (OpenEXR)")]
    UnknownFormat(PathBuf),
    /// The file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Reason, as reported by the system or the decoder.
        reason: String,
    },
    /// The file cannot be written.
    #[error("cannot write {path}: {reason}")]
    Write {
        /// Path of the file.
        path: PathBuf,
        /// Reason, as reported by the system or the decoder.
        reason: String,
    },
    /// The image is not twice as wide as it is high.
    #[error("{path} is {size} pixels; an equirectangular image is twice as wide as it is high, and at least 2 × 1")]
    Shape {
        /// Path of the file.
        path: PathBuf,
        /// Width and height in pixels.
        size: UVec2,
    },
}

/// Format of a file, by the extension of its name.
fn format_of(path: &Path) -> Result<ImageFormat, EnvironmentFileError> {
    match ImageFormat::from_path(path) {
        Ok(format) if is_linear(format) => Ok(format),
        _ => Err(EnvironmentFileError::UnknownFormat(path.to_owned())),
    }
}

impl EquirectPixels {
    /// Reads a Radiance or OpenEXR file. The values of a Radiance file are divided by its `EXPOSURE`. Negative values
    /// and those that are not a number become 0, infinite ones 65504, the largest value of an environment cube, and
    /// none is larger than 1e20, so that sums stay finite.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, EnvironmentFileError> {
        let path = path.as_ref();
        let pixels = open_linear(path, format_of(path)?)
            .map_err(|reason| EnvironmentFileError::Read { path: path.to_owned(), reason: reason.to_string() })?;
        let size = UVec2::from(pixels.dimensions());
        if size.x != 2 * size.y || size.y == 0 {
            return Err(EnvironmentFileError::Shape { path: path.to_owned(), size });
        }
        let texels = pixels.pixels().map(|pixel| Vec3::from_array(pixel.0.map(clean_radiance))).collect();
        Ok(Self { size, texels })
    }

    /// Writes a Radiance or OpenEXR file, depending on the extension of its name.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), EnvironmentFileError> {
        let path = path.as_ref();
        let pixels = Rgb32FImage::from_fn(self.size.x, self.size.y, |x, y| {
            image::Rgb(self.texels[(y * self.size.x + x) as usize].to_array())
        });
        let format = format_of(path)?;
        File::create(path)
            .map_err(ImageError::from)
            .and_then(|file| pixels.write_to(&mut BufWriter::new(file), format))
            .map_err(|reason| EnvironmentFileError::Write { path: path.to_owned(), reason: reason.to_string() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join("bevy_mirrorball");
        std::fs::create_dir_all(&folder).expect("the system has a folder for such files");
        folder.join(format!("{}_{name}", std::process::id()))
    }

    fn gradient() -> EquirectPixels {
        let texels = (0..32).map(|i| Vec3::new(0.01 * i as f32, 1.0, 300.0 + i as f32)).collect();
        EquirectPixels { size: UVec2::new(8, 4), texels }
    }

    #[test]
    fn what_is_saved_is_read_again() {
        // With a common exponent, 8 bits are off by half a step of the brightest channel.
        for (name, tolerance) in [("sky.exr", 0.0), ("sky.hdr", 1.0 / 256.0)] {
            let path = scratch(name);
            gradient().save(&path).expect("written");
            let back = EquirectPixels::open(&path).expect("read");
            assert_eq!(back.size, gradient().size, "{name}");
            for (found, expected) in back.texels.iter().zip(&gradient().texels) {
                assert!(
                    found.distance(*expected) <= tolerance * 2.0 * expected.max_element(),
                    "{name}: {found}, {expected}"
                );
            }
            std::fs::remove_file(path).expect("exists");
        }
    }

    #[test]
    fn radiance_files_of_other_programs_are_read() {
        let texel = |header: &str| {
            let path = scratch("other.hdr");
            // 2 × 1 pixels of 1, 0.5, 0.25 with the common exponent of 1.
            let pixels = [128, 64, 32, 129, 128, 64, 32, 129];
            let file = [header.as_bytes(), b"\n-Y 1 +X 2\n", &pixels].concat();
            std::fs::write(&path, file).expect("written");
            let map = EquirectPixels::open(&path);
            std::fs::remove_file(&path).expect("exists");
            map.map(|map| map.texels[1]).map_err(|error| error.to_string())
        };
        let plain = Vec3::new(1.0, 0.5, 0.25);
        let format = "FORMAT=32-bit_rle_rgbe\n";
        assert_eq!(texel(&format!("#?RADIANCE\n{format}")), Ok(plain));
        assert_eq!(texel(&format!("#?RGBE\n{format}")), Ok(plain));
        assert_eq!(texel(&format!("#?RADIANCE\nEXPOSURE=2\n{format}EXPOSURE=4\n")), Ok(plain / 8.0));
        assert_eq!(texel(&format!("#?RADIANCE\nEXPOSURE=0\n{format}")), Ok(plain));
    }

    #[test]
    fn an_infinite_sun_leaves_cube_and_harmonics_finite() {
        let path = scratch("sun.exr");
        let mut sun = gradient();
        sun.texels[3..7].fill(Vec3::INFINITY);
        sun.texels[7] = Vec3::MAX;
        sun.save(&path).expect("written");
        let cube = EquirectPixels::open(&path).expect("read").to_cube(16, Quat::IDENTITY);
        std::fs::remove_file(&path).expect("exists");
        assert!(cube.texels.iter().all(|texel| texel.is_finite()));
        let light = cube.harmonics().diffuse(Vec3::Y);
        assert!(light.is_finite() && light.min_element() > 0.0, "{light}");
    }

    #[test]
    fn values_that_are_no_radiance_do_no_harm() {
        let path = scratch("odd.exr");
        let mut odd = gradient();
        odd.texels[0] = Vec3::new(-1.0, f32::NAN, f32::INFINITY);
        odd.save(&path).expect("written");
        assert_eq!(EquirectPixels::open(&path).expect("read").texels[0], Vec3::new(0.0, 0.0, 65504.0));
        std::fs::remove_file(path).expect("exists");
    }

    #[test]
    fn what_is_wrong_is_said_with_the_file() {
        let complaint = |result: Result<EquirectPixels, EnvironmentFileError>| result.expect_err("refused").to_string();
        assert!(complaint(EquirectPixels::open("sky.png")).contains("sky.png is of an unknown format; name it .hdr"));
        assert!(complaint(EquirectPixels::open("nowhere.hdr")).contains("cannot read nowhere.hdr"));
        assert!(complaint(EquirectPixels::open("nowhere.exr")).contains("cannot read nowhere.exr"));
        let path = scratch("square.exr");
        EquirectPixels { size: UVec2::splat(2), texels: vec![Vec3::ONE; 4] }.save(&path).expect("written");
        assert!(complaint(EquirectPixels::open(&path)).contains("twice as wide"));
        std::fs::write(&path, b"not an image").expect("written");
        assert!(complaint(EquirectPixels::open(&path)).contains("cannot read"));
        std::fs::remove_file(&path).expect("exists");
        let nowhere = Path::new("no such folder").join("sky.hdr");
        let error = gradient().save(nowhere).expect_err("refused").to_string();
        assert!(error.contains("cannot write") && error.contains("no such folder"), "{error}");
    }
}
