//! Decoding of image files, at once or in the background.

use super::{CameraError, FramePixels, Intrinsics, source::SourceFrame};
use crate::image_files::{check_size, is_linear, open_linear, without_panic};
use bevy::{
    platform::time::Instant,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, ImageResult};
use std::{
    io::{BufRead, Cursor, Seek},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

impl FramePixels {
    /// Reads and decodes an image file, upright: turned and mirrored as its EXIF orientation says. Linear formats
    /// (Radiance, OpenEXR) are encoded to sRGB, and clip above 1 as a camera's sensor would.
    ///
    /// # Errors
    /// [`CameraError::File`] names the file and contains the error of the decoder.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, CameraError> {
        let path = path.as_ref();
        let fail = |source| CameraError::File { path: path.to_owned(), source };
        decode_upright(path).map_err(fail).map(into_pixels)
    }
}

fn into_pixels(image: DynamicImage) -> FramePixels {
    let image = image.into_rgba8();
    FramePixels { size: UVec2::new(image.width(), image.height()), rgba: image.into_raw() }
}

/// Decodes an image file and applies its EXIF orientation; encodes linear values to sRGB.
fn decode_upright(path: &Path) -> ImageResult<DynamicImage> {
    let reader = ImageReader::open(path)?.with_guessed_format()?;
    if let Some(format) = reader.format().filter(|format| is_linear(*format)) {
        let mut linear = open_linear(path, format)?;
        for value in linear.iter_mut() {
            let seen = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
            *value = Srgba::gamma_function_inverse(seen);
        }
        return Ok(DynamicImage::ImageRgb32F(linear));
    }
    decode_reader(reader, std::fs::metadata(path)?.len())
}

/// The same for a file of some length that a decoder of `image` reads.
fn decode_reader(reader: ImageReader<impl BufRead + Seek>, length: u64) -> ImageResult<DynamicImage> {
    let format = reader.format();
    without_panic(format.unwrap_or(ImageFormat::Jpeg), || {
        let mut decoder = reader.into_decoder()?;
        if format == Some(ImageFormat::Jpeg) {
            let (width, height) = decoder.dimensions();
            check_size(ImageFormat::Jpeg, (width.into(), height.into()), 4, length)?;
        }
        let orientation = decoder.orientation()?;
        let mut image = DynamicImage::from_decoder(decoder)?;
        image.apply_orientation(orientation);
        Ok(image)
    })
}

/// An image file, in memory or not.
pub(super) struct EncodedImage {
    pub path: PathBuf,
    pub bytes: Option<Arc<[u8]>>,
}

impl EncodedImage {
    pub(super) fn decode(&self) -> Decoded {
        match &self.bytes {
            Some(bytes) => Decoded::from_bytes(bytes, &self.path),
            None => Decoded::from_file(&self.path),
        }
    }
}

/// An image file that is being decoded in the background.
pub(super) struct Decoding(Task<Decoded>);

/// A decoded image file or the error, and the time that decoding took.
pub(super) struct Decoded {
    pixels: Result<FramePixels, CameraError>,
    time: Duration,
}

impl Decoding {
    pub(super) fn start(path: PathBuf) -> Self {
        Self(AsyncComputeTaskPool::get_or_init(TaskPool::default).spawn(async move { Decoded::from_file(&path) }))
    }

    /// Returns the image once it is decoded.
    pub(super) fn finish(&mut self) -> Option<Decoded> {
        check_ready(&mut self.0)
    }
}

impl Decoded {
    pub(super) fn from_file(path: &Path) -> Self {
        let started = Instant::now();
        let pixels = FramePixels::open(path);
        Self { pixels, time: started.elapsed() }
    }

    fn from_bytes(bytes: &[u8], path: &Path) -> Self {
        let started = Instant::now();
        let decode = || {
            let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
            decode_reader(reader, bytes.len() as u64)
        };
        let pixels = decode().map_err(|source| CameraError::File { path: path.to_owned(), source }).map(into_pixels);
        Self { pixels, time: started.elapsed() }
    }

    pub(super) fn into_frame(
        self,
        captured: Duration,
        intrinsics: Option<Intrinsics>,
    ) -> Result<SourceFrame, CameraError> {
        let pixels = Arc::new(self.pixels?);
        Ok(SourceFrame { pixels, captured, decode_time: self.time, intrinsics, exposure: 1.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{ImageEncoder, Rgb32FImage, RgbImage, codecs::png::PngEncoder};

    /// Exif data with nothing but an orientation, in little-endian TIFF.
    fn exif(orientation: u8) -> Vec<u8> {
        let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
        [&b"II*\0\x08\0\0\0\x01\0"[..], &entry, &[0; 4]].concat()
    }

    fn scratch(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("bevy_mirrorball_{}_{name}", std::process::id()))
    }

    #[test]
    fn photographs_are_turned_as_their_exif_orientation_says() {
        // Upright, the pixels are 1 2 / 3 4 / 5 6. Stored as each orientation stores them (EXIF 2.3, 4.6.4).
        let stored: [(u8, u32, [u8; 6]); 8] = [
            (1, 2, [1, 2, 3, 4, 5, 6]),
            (2, 2, [2, 1, 4, 3, 6, 5]),
            (3, 2, [6, 5, 4, 3, 2, 1]),
            (4, 2, [5, 6, 3, 4, 1, 2]),
            (5, 3, [1, 3, 5, 2, 4, 6]),
            (6, 3, [2, 4, 6, 1, 3, 5]),
            (7, 3, [6, 4, 2, 5, 3, 1]),
            (8, 3, [5, 3, 1, 6, 4, 2]),
        ];
        for (orientation, width, pixels) in stored {
            let path = scratch(&format!("turned_{orientation}.png"));
            let image = RgbImage::from_fn(width, 6 / width, |x, y| image::Rgb([pixels[(y * width + x) as usize]; 3]));
            let mut encoder = PngEncoder::new(std::fs::File::create(&path).expect("a writable folder"));
            encoder.set_exif_metadata(exif(orientation)).expect("PNG has Exif data");
            encoder.write_image(&image, width, 6 / width, image::ExtendedColorType::Rgb8).expect("written");
            let frame = FramePixels::open(&path).expect("an image");
            std::fs::remove_file(&path).expect("exists");
            let found: Vec<u8> = frame.rgba.chunks_exact(4).map(|pixel| pixel[0]).collect();
            assert_eq!((frame.size, &found[..]), (UVec2::new(2, 3), &[1, 2, 3, 4, 5, 6][..]), "{orientation}");
        }
    }

    #[test]
    fn radiance_frames_of_other_programs_are_read_like_environments() {
        let path = scratch("other.hdr");
        // 2 × 1 pixels of 1, 0.5, 0.25 with the common exponent of 1, twice as bright as they were.
        let pixels = [128, 64, 32, 129, 128, 64, 32, 129];
        let header = b"#?RGBE\nEXPOSURE=2\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
        std::fs::write(&path, [&header[..], &pixels].concat()).expect("written");
        let frame = FramePixels::open(&path).expect("an image");
        std::fs::remove_file(&path).expect("exists");
        assert_eq!(frame.rgb8(1, 0), [188, 137, 99]);
    }

    #[test]
    fn a_jpeg_that_claims_more_than_it_can_hold_takes_no_memory() {
        let path = scratch("claims.jpg");
        RgbImage::new(16, 16).save(&path).expect("written");
        let mut bytes = std::fs::read(&path).expect("written");
        let frame = bytes.windows(2).position(|pair| pair == [0xFF, 0xC0]).expect("a frame header");
        bytes[frame + 5..frame + 9].fill(0xF0);
        std::fs::write(&path, bytes).expect("written");
        let text = FramePixels::open(&path).expect_err("damaged").to_string();
        std::fs::remove_file(&path).expect("exists");
        assert!(text.contains("61680 × 61680"), "{text}");
    }

    #[test]
    fn linear_images_are_encoded_as_a_camera_would() {
        for (name, format) in [("linear.hdr", ImageFormat::Hdr), ("linear.exr", ImageFormat::OpenExr)] {
            let path = scratch(name);
            let values = [0.0, 0.5, 7.0];
            let image = Rgb32FImage::from_fn(3, 1, |x, _| image::Rgb([values[x as usize]; 3]));
            image.save_with_format(&path, format).expect("written");
            let frame = FramePixels::open(&path).expect("an image");
            std::fs::remove_file(&path).expect("exists");
            assert_eq!([0, 1, 2].map(|x| frame.rgb8(x, 0)[1]), [0, 188, 255], "{name}");
        }
    }
}
