//! Decoding of image files, at once or in the background.

use super::{CameraError, FramePixels, Intrinsics, source::SourceFrame};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

impl FramePixels {
    /// Reads and decodes an image file.
    ///
    /// # Errors
    /// [`CameraError::File`] names the file and contains the error of the decoder.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, CameraError> {
        let path = path.as_ref();
        let fail = |source| CameraError::File { path: path.to_owned(), source };
        let image = image::ImageReader::open(path)
            .and_then(image::ImageReader::with_guessed_format)
            .map_err(|error| fail(error.into()))?
            .decode()
            .map_err(fail)?
            .into_rgba8();
        Ok(Self { size: UVec2::new(image.width(), image.height()), rgba: image.into_raw() })
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

    pub(super) fn into_frame(
        self,
        captured: Duration,
        intrinsics: Option<Intrinsics>,
    ) -> Result<SourceFrame, CameraError> {
        let pixels = Arc::new(self.pixels?);
        Ok(SourceFrame { pixels, captured, decode_time: self.time, intrinsics, exposure: 1.0 })
    }
}
