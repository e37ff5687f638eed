//! Where pictures come from.

use super::{CameraFrame, FramePixels};
use bevy::prelude::*;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

/// What can go wrong on the way from a source to a picture.
#[derive(thiserror::Error, Debug)]
pub enum CameraError {
    /// A picture file could not be read or decoded.
    #[error("cannot read the picture {path}: {source}. Give a PNG, JPEG or Radiance file that other programs can open")]
    Picture {
        /// The file as it was named.
        path: PathBuf,
        /// What the decoder said.
        source: image::ImageError,
    },
}

/// Source of an [`ArCamera`](super::ArCamera)'s pictures.
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(opaque, Component, Debug, Clone)]
#[require(FeedState)]
pub struct CameraFeed {
    source: FeedSource,
}

#[derive(Clone, Debug)]
enum FeedSource {
    Picture(PathBuf),
    Pixels(Arc<FramePixels>),
}

impl CameraFeed {
    /// A still picture from a PNG or JPEG file, decoded once when the component is added or replaced.
    pub fn picture(path: impl Into<PathBuf>) -> Self {
        Self { source: FeedSource::Picture(path.into()) }
    }

    /// Pixels the game has already; insert a new `CameraFeed` for each new picture.
    pub fn pixels(pixels: impl Into<Arc<FramePixels>>) -> Self {
        Self { source: FeedSource::Pixels(pixels.into()) }
    }
}

/// How a feed is doing.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub enum FeedState {
    /// No picture has arrived yet.
    #[default]
    Waiting,
    /// Pictures arrive.
    Playing,
    /// The source cannot be used; the text says why and what to do. The last good picture stays.
    Failed(String),
}

impl FramePixels {
    /// Reads and decodes a picture file.
    ///
    /// # Errors
    /// [`CameraError::Picture`] names the file and what was wrong with it.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, CameraError> {
        let path = path.as_ref();
        let fail = |source| CameraError::Picture { path: path.to_owned(), source };
        let picture = image::ImageReader::open(path)
            .and_then(image::ImageReader::with_guessed_format)
            .map_err(|error| fail(error.into()))?
            .decode()
            .map_err(fail)?
            .into_rgba8();
        Ok(Self { size: UVec2::new(picture.width(), picture.height()), rgba: picture.into_raw() })
    }
}

pub(super) fn poll_feeds(
    mut commands: Commands,
    mut feeds: Query<(Entity, &CameraFeed, &mut FeedState, Option<&CameraFrame>), Changed<CameraFeed>>,
    time: Res<Time<Real>>,
) {
    for (entity, feed, mut state, last) in &mut feeds {
        let pixels = match &feed.source {
            FeedSource::Picture(path) => match FramePixels::open(path) {
                Ok(pixels) => Arc::new(pixels),
                Err(error) => {
                    error!("camera {entity}: {error}");
                    *state = FeedState::Failed(error.to_string());
                    continue;
                }
            },
            FeedSource::Pixels(pixels) => pixels.clone(),
        };
        *state = FeedState::Playing;
        let sequence = last.map_or(0, |frame| frame.sequence) + 1;
        let captured: Duration = time.elapsed();
        commands.entity(entity).insert(CameraFrame { pixels, sequence, captured });
    }
}
