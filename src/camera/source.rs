//! What is behind a feed: something that is asked for its newest picture once an update.

#[cfg(feature = "webcam")]
use super::webcam::{Captured, Webcam, WebcamStatus};
use super::{
    CameraError, CameraFeed, FeedPace, FeedState, FramePixels, Intrinsics,
    clip_source::ClipSource,
    exposure_series::check_exposure,
    feed::{FeedSource, Picture},
    image_feed::{ImageSlot, ImageSource},
};
use bevy::{
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

/// Gives the newest picture.
pub(super) trait FrameSource: Send + Sync {
    /// What has happened since the last call; `now` is the elapsed [`Time<Real>`].
    fn poll(&mut self, now: Duration) -> Arrival;

    /// Where to put the pixels of the image that this source shows, if it shows one.
    fn image_slot(&self) -> Option<ImageSlot> {
        None
    }
}

/// What a source has to say.
#[derive(Default)]
pub(super) struct Arrival {
    /// The newest one of the usual exposure.
    pub picture: Option<Picture>,
    /// Those of shorter exposures.
    pub shorter: Vec<Picture>,
    /// Pictures of the usual exposure skipped before `picture`, and damaged ones.
    pub dropped: u64,
    /// Said by sources that are in trouble; a picture means [`FeedState::Playing`] anyway.
    pub state: Option<FeedState>,
}

impl Arrival {
    pub(super) fn lost(error: &CameraError) -> Self {
        Self { dropped: 1, state: Some(FeedState::Lost(error.to_string())), ..default() }
    }

    pub(super) fn failed(error: &CameraError) -> Self {
        Self { state: Some(FeedState::Failed(error.to_string())), ..default() }
    }
}

/// The source of a feed that could be opened.
#[derive(Component)]
pub(super) struct OpenFeed(pub Box<dyn FrameSource>);

/// Opens what a feed names.
pub(super) fn open(feed: &CameraFeed) -> Result<OpenFeed, CameraError> {
    check_exposure(feed.exposure)?;
    Ok(OpenFeed(match &feed.source {
        FeedSource::Picture(path) => Box::new(Still::Unread(path.clone(), feed.pace)),
        FeedSource::Pixels(pixels) => Box::new(Supplied(Some(pixels.clone()))),
        FeedSource::Clip(folder) => Box::new(ClipSource::open(folder, feed.pace)?),
        FeedSource::Image(_) => Box::new(ImageSource::default()),
        #[cfg(feature = "webcam")]
        FeedSource::Device(options) => Box::new(Webcam::open(options.clone())),
    }))
}

/// A picture file that is being decoded in the background.
pub(super) struct Decoding(Task<Decoded>);

/// A decoded picture file, or why there is none, and how long it took.
pub(super) struct Decoded {
    pixels: Result<FramePixels, CameraError>,
    time: Duration,
}

impl Decoding {
    pub(super) fn start(path: PathBuf) -> Self {
        Self(AsyncComputeTaskPool::get_or_init(TaskPool::default).spawn(async move { Decoded::from_file(&path) }))
    }

    /// The picture once it is there.
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

    pub(super) fn into_picture(
        self,
        captured: Duration,
        intrinsics: Option<Intrinsics>,
    ) -> Result<Picture, CameraError> {
        let pixels = Arc::new(self.pixels?);
        Ok(Picture { pixels, captured, decode_time: self.time, intrinsics, exposure: 1.0 })
    }
}

/// One picture file.
enum Still {
    Unread(PathBuf, FeedPace),
    Decoding(Decoding),
    Read,
}

impl FrameSource for Still {
    fn poll(&mut self, now: Duration) -> Arrival {
        if let Self::Unread(path, pace) = self {
            if *pace == FeedPace::Live {
                *self = Self::Decoding(Decoding::start(path.clone()));
            } else {
                let decoded = Decoded::from_file(path);
                *self = Self::Read;
                return Self::arrival(decoded, now);
            }
        }
        let Self::Decoding(decoding) = self else {
            return Arrival::default();
        };
        let Some(decoded) = decoding.finish() else {
            return Arrival::default();
        };
        *self = Self::Read;
        Self::arrival(decoded, now)
    }
}

impl Still {
    fn arrival(decoded: Decoded, now: Duration) -> Arrival {
        match decoded.into_picture(now, None) {
            Ok(picture) => Arrival { picture: Some(picture), ..default() },
            Err(error) => Arrival::failed(&error),
        }
    }
}

/// Pixels that were there from the start.
struct Supplied(Option<Arc<FramePixels>>);

impl FrameSource for Supplied {
    fn poll(&mut self, now: Duration) -> Arrival {
        let picture = self.0.take().map(|pixels| Picture {
            pixels,
            captured: now,
            decode_time: Duration::ZERO,
            intrinsics: None,
            exposure: 1.0,
        });
        Arrival { picture, ..default() }
    }
}

#[cfg(feature = "webcam")]
impl FrameSource for Webcam {
    fn poll(&mut self, now: Duration) -> Arrival {
        let state = match self.status() {
            WebcamStatus::Lost(reason) => Some(FeedState::Lost(reason)),
            WebcamStatus::Opening | WebcamStatus::Playing(_) => None,
        };
        let picture = |captured: Captured| Picture {
            pixels: Arc::new(captured.pixels),
            captured: now.saturating_sub(captured.at.elapsed()),
            decode_time: captured.decode_time,
            intrinsics: None,
            exposure: captured.exposure,
        };
        let shorter = self.take_shorter().into_iter().map(picture).collect();
        let Some(captured) = self.take() else {
            return Arrival { shorter, state, ..default() };
        };
        let dropped = captured.dropped;
        Arrival { picture: Some(picture(captured)), shorter, dropped, state }
    }
}
