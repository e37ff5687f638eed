//! Pixels of photographs of balls: as a camera delivers them, or linear and unclipped from a Radiance or OpenEXR file.

use super::clipping::is_clipped;
use crate::{
    camera::{CameraError, FramePixels},
    image_files::{clean_radiance, is_linear, open_linear},
};
use glam::{UVec2, Vec3};
use image::{ImageFormat, ImageReader};
use std::{fmt::Debug, path::Path};

/// Pixels that a [`BallPhoto`](super::BallPhoto) can be made of: [`FramePixels`] and [`LinearPixels`].
pub trait PhotoPixels: Debug + Send + Sync {
    /// Width and height in pixels.
    fn size(&self) -> UVec2;

    /// A pixel in linear camera units; coordinates outside the photograph are clamped to its border.
    fn linear(&self, x: i32, y: i32) -> Vec3;

    /// Whether the true value of a pixel is larger than [`linear`](Self::linear) says, in at least one channel.
    fn is_clipped(&self, x: i32, y: i32) -> bool;
}

impl PhotoPixels for FramePixels {
    fn size(&self) -> UVec2 {
        self.size
    }

    fn linear(&self, x: i32, y: i32) -> Vec3 {
        Self::linear(self, x, y)
    }

    fn is_clipped(&self, x: i32, y: i32) -> bool {
        is_clipped(self, x, y)
    }
}

/// Photograph with linear values that never clip, as from several exposures merged into a Radiance or OpenEXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPixels {
    size: UVec2,
    texels: Vec<Vec3>,
}

impl LinearPixels {
    /// Wraps linear values, rows from top to bottom. Negative values and those that are not a number become 0, infinite
    /// ones 65504, and none is larger than 1e20. Returns `None` if their number does not match the size or the size is
    /// empty.
    pub fn new(size: UVec2, mut texels: Vec<Vec3>) -> Option<Self> {
        texels.iter_mut().for_each(|texel| *texel = texel.map(clean_radiance));
        let expected = size.x as usize * size.y as usize;
        (expected > 0 && texels.len() == expected).then_some(Self { size, texels })
    }
}

impl PhotoPixels for LinearPixels {
    fn size(&self) -> UVec2 {
        self.size
    }

    fn linear(&self, x: i32, y: i32) -> Vec3 {
        let x = x.clamp(0, self.size.x as i32 - 1) as usize;
        let y = y.clamp(0, self.size.y as i32 - 1) as usize;
        self.texels[y * self.size.x as usize + x]
    }

    fn is_clipped(&self, _: i32, _: i32) -> bool {
        false
    }
}

/// Reads a photograph of a ball: Radiance and OpenEXR files as [`LinearPixels`], linear and unclipped, others as
/// [`FramePixels`].
///
/// # Errors
/// [`CameraError::File`] names the file and contains the error of the decoder.
pub fn open_photo(path: impl AsRef<Path>) -> Result<Box<dyn PhotoPixels>, CameraError> {
    let path = path.as_ref();
    let fail = |source| CameraError::File { path: path.to_owned(), source };
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let format = reader.map_err(|error| fail(error.into()))?.format();
    let Some(format) = format.filter(|format: &ImageFormat| is_linear(*format)) else {
        return Ok(Box::new(FramePixels::open(path)?));
    };
    let image = open_linear(path, format).map_err(fail)?;
    let size = UVec2::from(image.dimensions());
    let texels = image.pixels().map(|pixel| Vec3::from_array(pixel.0)).collect();
    let pixels = LinearPixels::new(size, texels);
    Ok(Box::new(pixels.ok_or_else(|| fail(std::io::Error::other("the photograph is empty").into()))?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb32FImage;

    #[test]
    fn linear_files_stay_linear_and_unclipped() {
        for (name, format) in [("ball.hdr", ImageFormat::Hdr), ("ball.EXR", ImageFormat::OpenExr)] {
            let path = std::env::temp_dir().join(format!("bevy_mirrorball_{}_{name}", std::process::id()));
            let image = Rgb32FImage::from_fn(2, 1, |x, _| image::Rgb([[0.25; 3], [32.0; 3]][x as usize]));
            image.save_with_format(&path, format).expect("written");
            let photo = open_photo(&path).expect("a photograph");
            std::fs::remove_file(&path).expect("exists");
            assert_eq!(photo.size(), UVec2::new(2, 1), "{name}");
            assert_eq!((photo.linear(-1, 0), photo.linear(1, 3)), (Vec3::splat(0.25), Vec3::splat(32.0)), "{name}");
            assert!(!photo.is_clipped(1, 0), "{name}");
        }
    }

    #[test]
    fn values_that_are_no_radiance_do_no_harm() {
        let odd = LinearPixels::new(UVec2::ONE, vec![Vec3::new(-1.0, f32::NAN, f32::INFINITY)]).expect("fits");
        assert_eq!(odd.linear(0, 0), Vec3::new(0.0, 0.0, 65504.0));
        assert!(LinearPixels::new(UVec2::ONE, Vec::new()).is_none());
    }
}
