//! Where pictures come from, and how that is going.

use super::{FeedState, FeedStatistics, FramePixels};
use bevy::prelude::*;
use std::{path::PathBuf, sync::Arc};

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
    File(PathBuf),
    Pixels(Arc<FramePixels>),
    Clip(PathBuf),
    Image(Handle<Image>),
    #[cfg(feature = "webcam")]
    Device(super::DeviceOptions),
}

impl CameraFeed {
    /// A still picture from a PNG or JPEG file, decoded once when the component is added or replaced.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self::new(FeedSource::File(path.into()))
    }

    /// Old name of [`CameraFeed::file`].
    #[deprecated(since = "0.1.0", note = "use `CameraFeed::file`")]
    #[doc(hidden)]
    pub fn picture(path: impl Into<PathBuf>) -> Self {
        Self::file(path)
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
    /// below 1 are not shown; they go into [`BracketedFrames`](super::BracketedFrames) and tell what the next usual picture clips. 1 if
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
