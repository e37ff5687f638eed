//! Opening of feeds: the source behind each kind of feed.

#[cfg(any(feature = "webcam", target_arch = "wasm32"))]
use super::FeedState;
#[cfg(target_arch = "wasm32")]
use super::browser::{BrowserCamera, BrowserStatus};
#[cfg(feature = "webcam")]
use super::webcam::{Captured, Webcam, WebcamStatus};
use super::{
    CameraError, CameraFeed, FeedPace, FramePixels,
    bracketing::check_exposure,
    clip_asset::LoadedClips,
    clip_source::ClipSource,
    feed::FeedSource,
    image_feed::{ImageSlot, ImageSource},
    image_file::{Decoded, Decoding},
    source::{Arrival, FrameSource, SourceFrame},
};
use crate::relative_paths;
use bevy::prelude::*;
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

/// Source of a feed that was opened.
#[derive(Component)]
pub(super) struct OpenFeed(pub Box<dyn FrameSource>);

/// Opens the source of a feed.
///
/// The slot beside it exists for images of the game and receives their pixels. `None` while a clip is loading.
pub(super) fn open(
    feed: &CameraFeed,
    clips: &LoadedClips,
) -> Result<Option<(OpenFeed, Option<ImageSlot>)>, CameraError> {
    check_exposure(feed.exposure)?;
    let source: Box<dyn FrameSource> = match &feed.source {
        FeedSource::Nothing => Box::new(Supplied(None)),
        FeedSource::File(path) => Box::new(Still::Unread(locate(path, IMAGE)?, feed.pace)),
        FeedSource::Pixels(pixels) => Box::new(Supplied(Some(pixels.clone()))),
        FeedSource::Clip(folder) => Box::new(ClipSource::open(&locate(folder, CLIP)?, feed.pace)?),
        FeedSource::ClipAsset(handle) => match clips.get(handle)? {
            Some(clip) => Box::new(ClipSource::of_asset(clip, feed.pace)),
            None => return Ok(None),
        },
        FeedSource::Image(_) => {
            let (source, slot) = ImageSource::new();
            return Ok(Some((OpenFeed(Box::new(source)), Some(slot))));
        }
        #[cfg(feature = "webcam")]
        FeedSource::Device(options) => Box::new(Webcam::open(options.clone())),
        #[cfg(target_arch = "wasm32")]
        FeedSource::Browser(options) => Box::new(BrowserCamera::open(options.clone())),
    };
    Ok(Some((OpenFeed(source), None)))
}

const IMAGE: &str = "a PNG, JPEG, Radiance or OpenEXR file";
const CLIP: &str = "a clip: a folder of JPEG or PNG files with a sidecar clip.json beside them";

/// Finds the file of a feed.
fn locate(path: &Path, expected: &'static str) -> Result<PathBuf, CameraError> {
    relative_paths::locate(path).ok_or_else(|| CameraError::NotFound {
        path: path.to_owned(),
        working_directory: std::env::current_dir().unwrap_or_default(),
        asset_root: relative_paths::asset_root(),
        expected,
    })
}

/// Source that delivers a single image file.
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
        match decoded.into_frame(now, None) {
            Ok(frame) => Arrival { frame: Some(frame), ..default() },
            Err(error) => Arrival::failed(&error),
        }
    }
}

/// Source that delivers pixels of the game once.
struct Supplied(Option<Arc<FramePixels>>);

impl FrameSource for Supplied {
    fn poll(&mut self, now: Duration) -> Arrival {
        let frame = self.0.take().map(|pixels| SourceFrame {
            pixels,
            captured: now,
            decode_time: Duration::ZERO,
            intrinsics: None,
            exposure: 1.0,
        });
        Arrival { frame, ..default() }
    }
}

#[cfg(feature = "webcam")]
impl FrameSource for Webcam {
    fn poll(&mut self, now: Duration) -> Arrival {
        let state = match self.status() {
            WebcamStatus::Lost(reason) => Some(FeedState::Lost(reason)),
            WebcamStatus::Opening | WebcamStatus::Playing(_) => None,
        };
        let frame = |captured: Captured| SourceFrame {
            pixels: Arc::new(captured.pixels),
            captured: now.saturating_sub(captured.at.elapsed()),
            decode_time: captured.decode_time,
            intrinsics: None,
            exposure: captured.exposure,
        };
        let bracketed = self.take_shorter().into_iter().map(frame).collect();
        let Some(captured) = self.take() else {
            return Arrival { bracketed, state, ..default() };
        };
        let dropped = captured.dropped;
        Arrival { frame: Some(frame(captured)), bracketed, dropped, state }
    }
}

#[cfg(target_arch = "wasm32")]
impl FrameSource for BrowserCamera {
    fn poll(&mut self, now: Duration) -> Arrival {
        let state = match self.status() {
            BrowserStatus::Lost(reason) => Some(FeedState::Lost(reason)),
            BrowserStatus::Opening | BrowserStatus::Playing { .. } => None,
        };
        match self.take_notice() {
            Some(Ok(notice)) => info!("{notice}"),
            Some(Err(warning)) => warn!("{warning}"),
            None => {}
        }
        let Some(captured) = self.take() else {
            return Arrival { state, ..default() };
        };
        let frame = FramePixels::new(captured.size, captured.rgba).map(|pixels| SourceFrame {
            pixels: Arc::new(pixels),
            captured: now.saturating_sub(captured.age),
            decode_time: captured.read_time,
            intrinsics: None,
            exposure: 1.0,
        });
        Arrival { dropped: captured.dropped + u64::from(frame.is_none()), frame, state, ..default() }
    }
}
