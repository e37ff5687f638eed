//! Files of environments: equirectangular images in Radiance (`.hdr`) and OpenEXR (`.exr`) format.
//!
//! Both formats hold linear radiance, Radiance with 8 bits and a common exponent (1 % steps), OpenEXR as 32-bit
//! floats. The [layout](EquirectPixels) is that of the image in memory. Many programs put −Z into the center of the
//! image instead of its left edge. Rotate such an image by `Quat::from_rotation_y(PI)` when it becomes a cube.

use super::EquirectPixels;
use bevy::prelude::*;
use image::{ImageError, ImageFormat, ImageReader, Rgb32FImage};
use std::{
    fs::File,
    io::{BufReader, BufWriter},
    path::{Path, PathBuf},
};

/// Error on reading or writing a file of an environment.
#[derive(thiserror::Error, Debug)]
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
        Ok(format @ (ImageFormat::Hdr | ImageFormat::OpenExr)) => Ok(format),
        _ => Err(EnvironmentFileError::UnknownFormat(path.to_owned())),
    }
}

impl EquirectPixels {
    /// Reads a Radiance or OpenEXR file. Negative values and those that are not a number become 0, infinite ones the
    /// largest finite value.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, EnvironmentFileError> {
        let path = path.as_ref();
        let pixels = read(path, format_of(path)?)
            .map_err(|reason| EnvironmentFileError::Read { path: path.to_owned(), reason: reason.to_string() })?;
        let size = UVec2::from(pixels.dimensions());
        if size.x != 2 * size.y || size.y == 0 {
            return Err(EnvironmentFileError::Shape { path: path.to_owned(), size });
        }
        let clean = |value: f32| if value.is_nan() { 0.0 } else { value.clamp(0.0, f32::MAX) };
        let texels = pixels.pixels().map(|pixel| Vec3::from_array(pixel.0).map(clean)).collect();
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

/// Decodes a file, without a size limit: environments are large, and the game has chosen them.
fn read(path: &Path, format: ImageFormat) -> Result<Rgb32FImage, ImageError> {
    let mut reader = ImageReader::with_format(BufReader::new(File::open(path)?), format);
    reader.no_limits();
    Ok(reader.decode()?.into_rgb32f())
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
    fn values_that_are_no_radiance_do_no_harm() {
        let path = scratch("odd.exr");
        let mut odd = gradient();
        odd.texels[0] = Vec3::new(-1.0, f32::NAN, f32::INFINITY);
        odd.save(&path).expect("written");
        assert_eq!(EquirectPixels::open(&path).expect("read").texels[0], Vec3::new(0.0, 0.0, f32::MAX));
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
