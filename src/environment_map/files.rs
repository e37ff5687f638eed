//! Environments in files: Radiance (`.hdr`) and OpenEXR (`.exr`), equirectangular.
//!
//! Both keep linear radiance; Radiance with 8 bits and a common exponent (1 % steps), OpenEXR as 32-bit floats.
//! The [layout](EquirectPixels) is that of the picture in memory. Many programs put −Z into the middle of the picture instead of at
//! its left edge: turn it with `Quat::from_rotation_y(PI)` when it becomes a cube.

use super::EquirectPixels;
use bevy::prelude::*;
use image::{ImageError, ImageFormat, ImageReader, Rgb32FImage};
use std::{
    fs::File,
    io::{BufReader, BufWriter},
    path::{Path, PathBuf},
};

/// What is wrong with a file of an environment.
#[derive(thiserror::Error, Debug)]
pub enum EnvironmentFileError {
    /// The file's name does not end in a format that is known.
    #[error("{0} is of an unknown format; name it .hdr (Radiance) or .exr (OpenEXR)")]
    UnknownFormat(PathBuf),
    /// The file cannot be read.
    #[error("cannot read {path}: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The file cannot be written.
    #[error("cannot write {path}: {reason}")]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The picture is not twice as wide as it is high.
    #[error("{path} is {size} pixels; an equirectangular picture is twice as wide as it is high, and at least 2 × 1")]
    Shape {
        /// The file.
        path: PathBuf,
        /// Width and height in pixels.
        size: UVec2,
    },
}

/// The format that a file's name stands for.
fn format_of(path: &Path) -> Result<ImageFormat, EnvironmentFileError> {
    match ImageFormat::from_path(path) {
        Ok(format @ (ImageFormat::Hdr | ImageFormat::OpenExr)) => Ok(format),
        _ => Err(EnvironmentFileError::UnknownFormat(path.to_owned())),
    }
}

impl EquirectPixels {
    /// Reads a Radiance or OpenEXR file. Values that are no radiance (negative, not a number) become 0, infinite ones the
    /// largest finite.
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

    /// Writes a Radiance or OpenEXR file, by the name's ending.
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

/// Decodes a file without a limit of its size: environments are large, and the game chose them.
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

    fn picture() -> EquirectPixels {
        let texels = (0..32).map(|i| Vec3::new(0.01 * i as f32, 1.0, 300.0 + i as f32)).collect();
        EquirectPixels { size: UVec2::new(8, 4), texels }
    }

    #[test]
    fn what_is_saved_is_read_again() {
        // A common exponent of 8 bits: half a step of the brightest channel.
        for (name, tolerance) in [("sky.exr", 0.0), ("sky.hdr", 1.0 / 256.0)] {
            let path = scratch(name);
            picture().save(&path).expect("written");
            let back = EquirectPixels::open(&path).expect("read");
            assert_eq!(back.size, picture().size, "{name}");
            for (found, expected) in back.texels.iter().zip(&picture().texels) {
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
        let mut odd = picture();
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
        std::fs::write(&path, b"not a picture").expect("written");
        assert!(complaint(EquirectPixels::open(&path)).contains("cannot read"));
        std::fs::remove_file(&path).expect("exists");
        let nowhere = Path::new("no such folder").join("sky.hdr");
        let error = picture().save(nowhere).expect_err("refused").to_string();
        assert!(error.contains("cannot write") && error.contains("no such folder"), "{error}");
    }
}
