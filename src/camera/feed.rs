//! Camera feeds: the source of the frames of a camera, and its settings.

use super::{ClipAsset, FeedState, FeedStatistics, FramePixels, feed_events::ReportedFeed};
use bevy::prelude::*;
use std::{path::PathBuf, sync::Arc};

/// Source of the frames of an [`ArCamera`](super::ArCamera).
///
/// # Paths
/// Absolute paths of [files](Self::file) and [clips](Self::clip), and those that exist in the working directory, are
/// taken as they are. Any other path starts where Bevy's file assets start: in the folder `BEVY_ASSET_ROOT`, in the
/// package when `cargo` runs the game, else beside the executable. So `"assets/desk/photo.jpg"` is found with
/// `cargo run` from anywhere, and in a game that is shipped with its `assets` folder. It is a path in the file system,
/// so the folder `assets` is part of it, unlike in paths of the [`AssetServer`].
///
/// Decoding runs in the background. If frames arrive faster than they are used, the newest one is kept and the others
/// are counted as dropped. [`FeedState`] on the same entity reports whether frames arrive, [`FeedStatistics`] how
/// many.
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
#[reflect(opaque, Component, Default, Debug, Clone)]
#[require(FeedState, FeedStatistics, ReportedFeed)]
pub struct CameraFeed {
    pub(super) source: FeedSource,
    pub(super) pace: FeedPace,
    pub(super) exposure: f32,
}

#[derive(Clone, Debug, Default)]
pub(super) enum FeedSource {
    #[default]
    Nothing,
    File(PathBuf),
    Pixels(Arc<FramePixels>),
    Clip(PathBuf),
    ClipAsset(Handle<ClipAsset>),
    Image(Handle<Image>),
    #[cfg(feature = "webcam")]
    Device(super::DeviceOptions),
    #[cfg(target_arch = "wasm32")]
    Browser(super::BrowserCameraOptions),
}

impl Default for CameraFeed {
    /// A feed without a source, which stays [`FeedState::Waiting`]: for scenes that are given their feed later.
    fn default() -> Self {
        Self::new(FeedSource::Nothing)
    }
}

// A handle takes its component out of Bevy's blanket `FromTemplate`, which `bsn!` needs; constructors are given one.
impl Unpin for CameraFeed {}

impl CameraFeed {
    /// A still image from a PNG, JPEG, Radiance or OpenEXR file, see [paths](Self#paths). It is decoded once, when the
    /// component is added or replaced.
    pub fn file(path: impl Into<PathBuf>) -> Self {
        Self::new(FeedSource::File(path.into()))
    }

    /// Old name of [`CameraFeed::file`].
    #[deprecated(since = "0.1.0", note = "use `CameraFeed::file`")]
    #[doc(hidden)]
    pub fn picture(path: impl Into<PathBuf>) -> Self {
        Self::file(path)
    }

    /// Pixels that the game already has. Insert a new `CameraFeed` for each new frame.
    pub fn pixels(pixels: impl Into<Arc<FramePixels>>) -> Self {
        Self::new(FeedSource::Pixels(pixels.into()))
    }

    /// A recorded clip, repeated forever: a folder (see [paths](Self#paths)) of JPEG or PNG files with a sidecar
    /// `clip.json`; see [`Clip`](super::Clip).
    pub fn clip(folder: impl Into<PathBuf>) -> Self {
        Self::new(FeedSource::Clip(folder.into()))
    }

    /// A recorded clip that Bevy's assets load, repeated forever: see [`ClipAsset`]. It is [`FeedState::Waiting`]
    /// until it is loaded. The way in browsers, which have no files.
    pub fn clip_asset(clip: Handle<ClipAsset>) -> Self {
        Self::new(FeedSource::ClipAsset(clip))
    }

    /// A webcam, given by its number or by [`DeviceOptions`](super::DeviceOptions) with name, size, frame rate and
    /// exposure.
    ///
    /// A camera that is missing or unplugged is [`FeedState::Lost`]; the feed looks for it every second. Webcams do
    /// not know their intrinsics: set [`ArCamera::intrinsics`](super::ArCamera::intrinsics).
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

    /// A camera of the browser, for which the browser asks the user.
    ///
    /// A camera that is refused, missing, busy or unplugged is [`FeedState::Lost`] with a text that says what to do.
    /// The feed takes it up again by itself where that shows the user no dialog a second time; insert a new
    /// `CameraFeed` to ask again, for example when the user presses a button. Cameras do not know their intrinsics:
    /// set [`ArCamera::intrinsics`](super::ArCamera::intrinsics).
    ///
    /// ```
    /// # use bevy::prelude::*;
    /// # use bevy_mirrorball::prelude::*;
    /// # #[cfg(target_arch = "wasm32")]
    /// # fn setup(mut commands: Commands) {
    /// // the camera on the back of a phone, or the only one of a laptop
    /// commands.spawn((ArCamera::default(), CameraFeed::browser(BrowserCameraOptions::default())));
    /// # }
    /// ```
    #[cfg(target_arch = "wasm32")]
    pub fn browser(options: super::BrowserCameraOptions) -> Self {
        Self::new(FeedSource::Browser(options))
    }

    /// An image of the game, for example of a video player, of another camera that renders into it or of a network
    /// stream.
    ///
    /// The feed takes a new frame each time the [`Image`] asset changes on the CPU. An image without data on the CPU is
    /// read back from the GPU once per frame, which takes a frame or two; it needs the usage `COPY_SRC`. The format has
    /// to be 8-bit `Rgba8` or `Bgra8`, in a single layer; of mip levels the first is taken. Bytes are taken as
    /// sRGB-encoded whether the format says so or not, as is usual for video. Tracking has the same requirements as for
    /// any frame: a sharp marker at least 40 pixels wide, rows from top to bottom, and
    /// [`ArCamera::intrinsics`](super::ArCamera::intrinsics) with the distortion of the lens, if there is one.
    pub fn image(image: Handle<Image>) -> Self {
        Self::new(FeedSource::Image(image))
    }

    /// Sets the pace. Defaults to [`FeedPace::Live`].
    pub fn with_pace(self, pace: FeedPace) -> Self {
        Self { pace, ..self }
    }

    /// Sets the exposure of these frames relative to the normal frames of the camera. Above 0 and at most 1; defaults
    /// to 1. Other values lead to [`FeedState::Failed`].
    ///
    /// Frames below 1 are not shown. They are collected in [`BracketedFrames`](super::BracketedFrames), where they
    /// resolve what the next normal frame clips.
    pub fn with_exposure(self, exposure: f32) -> Self {
        Self { exposure, ..self }
    }

    /// Pace of the feed.
    pub fn pace(&self) -> FeedPace {
        self.pace
    }

    /// Returns whether the feed delivers a frame only when it is opened, or when the game changes its image.
    pub(super) fn is_still(&self) -> bool {
        matches!(self.source, FeedSource::Nothing | FeedSource::File(_) | FeedSource::Pixels(_) | FeedSource::Image(_))
    }

    /// Whether the frames are those of a camera or video at present, not of a file or of pixels that the game has.
    pub(crate) fn is_video(&self) -> bool {
        match self.source {
            FeedSource::Nothing | FeedSource::File(_) | FeedSource::Pixels(_) => false,
            FeedSource::Clip(_) | FeedSource::ClipAsset(_) => false,
            FeedSource::Image(_) => true,
            #[cfg(feature = "webcam")]
            FeedSource::Device(_) => true,
            #[cfg(target_arch = "wasm32")]
            FeedSource::Browser(_) => true,
        }
    }

    /// Whether the frames come from a camera that is running.
    pub(crate) fn is_device(&self) -> bool {
        match self.source {
            #[cfg(feature = "webcam")]
            FeedSource::Device(_) => true,
            #[cfg(target_arch = "wasm32")]
            FeedSource::Browser(_) => true,
            _ => false,
        }
    }

    fn new(source: FeedSource) -> Self {
        Self { source, pace: FeedPace::default(), exposure: 1.0 }
    }
}

/// Synchronization of a feed with the updates of the game.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum FeedPace {
    /// The game never waits. Frames are decoded and searched for markers in the background and appear when that is
    /// finished.
    #[default]
    Live,
    /// Each update waits for the next frame and its markers. No frame is dropped and every run gives the same result.
    /// For rendering to files and for tests. With webcams and images, updates wait for the markers only, not for new
    /// frames.
    Lockstep,
}
