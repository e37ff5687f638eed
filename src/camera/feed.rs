//! Where pictures come from, and how that is going.

use super::{FramePixels, Intrinsics};
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
    /// A clip's folder or its sidecar could not be read.
    #[error(
        "cannot read {path}: {source}. A clip is a folder of JPEG or PNG files with a sidecar clip.json beside them"
    )]
    ClipUnreadable {
        /// The folder or file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A clip's sidecar is not what it has to be.
    #[error(
        "{path}: {source}. It needs \"image\": [width, height] and \"fps\"; \"intrinsics\": {{\"fx\", \"fy\", \"cx\", \"cy\"}} in pixels, \
         \"pattern\": \"frame_*.jpg\" and \"exposures\": [1, 1, 0.125] are optional"
    )]
    ClipSidecar {
        /// The sidecar.
        path: PathBuf,
        /// What is wrong, with field, line and column.
        source: serde_json::Error,
    },
    /// A number of a clip's sidecar makes no sense.
    #[error("{path}: \"{field}\" is {found}; it has to be {expected}")]
    ClipValue {
        /// The sidecar.
        path: PathBuf,
        /// The field.
        field: &'static str,
        /// Its value.
        found: String,
        /// What it has to be.
        expected: &'static str,
    },
    /// A clip has no pictures.
    #[error("no pictures named {pattern} in {folder}; put JPEG or PNG files there or correct \"pattern\" in clip.json")]
    ClipEmpty {
        /// The clip's folder.
        folder: PathBuf,
        /// The names that were looked for.
        pattern: String,
    },
    /// A feed's exposure cannot be.
    #[error(
        "the exposure of CameraFeed::with_exposure is {0}; it has to be above 0 and at most 1, the light that a usual picture gets"
    )]
    Exposure(f32),
    /// An image asset cannot be a camera picture.
    #[error("the image cannot be a camera picture: {0}")]
    Image(String),
}

/// Source of an [`ArCamera`](super::ArCamera)'s pictures.
///
/// Decoding runs in the background; when pictures come faster than they are used, the newest one wins and the rest is counted
/// as dropped. Read [`FeedState`] to see how it goes, [`FeedStatistics`] for figures.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// // a recorded clip, played in a loop at its own rate; its sidecar has the intrinsics
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip")));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(opaque, Component, Debug, Clone)]
#[require(FeedState, FeedStatistics)]
pub struct CameraFeed {
    pub(super) source: FeedSource,
    pub(super) pace: FeedPace,
    pub(super) exposure: f32,
}

#[derive(Clone, Debug)]
pub(super) enum FeedSource {
    Picture(PathBuf),
    Pixels(Arc<FramePixels>),
    Clip(PathBuf),
    Image(Handle<Image>),
    #[cfg(feature = "webcam")]
    Device(super::DeviceOptions),
}

impl CameraFeed {
    /// A still picture from a PNG or JPEG file, decoded once when the component is added or replaced.
    pub fn picture(path: impl Into<PathBuf>) -> Self {
        Self::new(FeedSource::Picture(path.into()))
    }

    /// Pixels the game has already; insert a new `CameraFeed` for each new picture.
    pub fn pixels(pixels: impl Into<Arc<FramePixels>>) -> Self {
        Self::new(FeedSource::Pixels(pixels.into()))
    }

    /// A recorded clip, repeated for ever: a folder of JPEG or PNG files with a sidecar `clip.json`; see [`Clip`](super::Clip).
    pub fn clip(folder: impl Into<PathBuf>) -> Self {
        Self::new(FeedSource::Clip(folder.into()))
    }

    /// A webcam: a number, or [`DeviceOptions`](super::DeviceOptions) with name, size, rate and exposure. A camera that is missing or
    /// unplugged is [`FeedState::Lost`]; it is looked for every second. Intrinsics have to be in
    /// [`ArCamera::intrinsics`](super::ArCamera::intrinsics).
    ///
    /// ```
    /// # use bevy::prelude::*;
    /// # use bevy_mirrorball::{camera::{DeviceId, DeviceOptions}, prelude::*};
    /// # fn setup(mut commands: Commands) {
    /// let options = DeviceOptions { device: DeviceId::Name("C920".into()), frame_rate: Some(30.0), ..default() };
    /// commands.spawn((ArCamera::default(), CameraFeed::device(options)));
    /// # }
    /// ```
    #[cfg(feature = "webcam")]
    pub fn device(options: impl Into<super::DeviceOptions>) -> Self {
        Self::new(FeedSource::Device(options.into()))
    }

    /// Any image of the game: a video player's, another camera's render target, a network stream's.
    ///
    /// A new picture is taken each time the [`Image`] asset changes on the CPU. An image without data on the CPU is read back
    /// from the GPU once a frame, which takes a frame or two; it needs the usage `COPY_SRC`. The format has to be 8-bit
    /// `Rgba8` or `Bgra8`; bytes are taken as sRGB-encoded whether the format says so or not, as video is. Tracking needs what it
    /// needs of any picture: a sharp marker at least 40 pixels wide, rows from top to bottom, no lens distortion, and
    /// [`ArCamera::intrinsics`](super::ArCamera::intrinsics).
    pub fn image(image: Handle<Image>) -> Self {
        Self::new(FeedSource::Image(image))
    }

    /// The same source at another pace. [`FeedPace::Live`] if never called.
    pub fn with_pace(self, pace: FeedPace) -> Self {
        Self { pace, ..self }
    }

    /// The same source, whose pictures got this much light compared with the usual ones of this camera: above 0 and at most 1. Those
    /// below 1 are not shown; they go into [`ShorterFrames`](super::ShorterFrames) and tell what the next usual picture clips. 1 if
    /// never called. Other numbers are [`FeedState::Failed`].
    pub fn with_exposure(self, exposure: f32) -> Self {
        Self { exposure, ..self }
    }

    /// Its pace.
    pub fn pace(&self) -> FeedPace {
        self.pace
    }

    fn new(source: FeedSource) -> Self {
        Self { source, pace: FeedPace::default(), exposure: 1.0 }
    }
}

/// How a feed and the game wait for each other.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum FeedPace {
    /// The game never waits: pictures are decoded and searched for markers in the background and appear when that is done.
    #[default]
    Live,
    /// Each update waits for the next picture and its markers: nothing is dropped, every run is the same. For rendering to
    /// files and for tests. Live cameras and images do not wait for new pictures, only their markers are waited for.
    Lockstep,
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
    /// Pictures have stopped for the moment; the text says why. The last good picture stays, and the feed goes on by itself when
    /// it can.
    Lost(String),
    /// The source cannot be used; the text says why and what to do. The last good picture stays. Insert a new
    /// [`CameraFeed`] to try again.
    Failed(String),
}

/// Figures of a feed since its [`CameraFeed`] was added to the entity.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct FeedStatistics {
    /// Pictures taken in, those of a shorter exposure aside.
    pub pictures: u64,
    /// Pictures of a shorter exposure taken in. They are neither shown nor counted as dropped when they are replaced.
    pub shorter: u64,
    /// Pictures the source had and the game never saw: replaced by newer ones, or damaged.
    pub dropped: u64,
    /// Pictures per second that the source delivers at its usual exposure, dropped ones included, smoothed. 0 until two have arrived.
    pub capture_rate: f32,
    /// Time the decoding of the newest picture took, in the background.
    pub decode_time: Duration,
    pub(super) last_captured: Option<Duration>,
}

/// Weight of the newest picture in the smoothed capture rate.
const RATE_SMOOTHING: f32 = 0.1;

impl FeedStatistics {
    /// Counts `dropped` pictures and then one that was taken in.
    pub(super) fn note_picture(&mut self, dropped: u64, captured: Duration, decode_time: Duration) {
        self.pictures += 1;
        self.decode_time = decode_time;
        let elapsed = self.last_captured.replace(captured).map(|last| captured.saturating_sub(last).as_secs_f32());
        if let Some(elapsed) = elapsed.filter(|elapsed| *elapsed > 0.0) {
            let rate = (1 + dropped) as f32 / elapsed;
            let weight = if self.capture_rate > 0.0 { RATE_SMOOTHING } else { 1.0 };
            self.capture_rate += weight * (rate - self.capture_rate);
        }
    }
}

/// A picture that has come out of a source.
#[derive(Clone, Debug)]
pub(super) struct Picture {
    pub pixels: Arc<FramePixels>,
    pub captured: Duration,
    pub decode_time: Duration,
    pub intrinsics: Option<Intrinsics>,
    /// Light it got, the usual picture's being 1.
    pub exposure: f32,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_capture_rate_counts_dropped_pictures_too() {
        let mut statistics = FeedStatistics::default();
        let at = Duration::from_millis;
        statistics.note_picture(0, at(0), at(1));
        assert_eq!(statistics.capture_rate, 0.0, "one picture has no rate");
        for i in 1..100 {
            statistics.note_picture(1, at(100 * i), at(1));
        }
        assert!((statistics.capture_rate - 20.0).abs() < 1e-3, "{statistics:?}");
        assert_eq!(statistics.pictures, 100);
    }
}
