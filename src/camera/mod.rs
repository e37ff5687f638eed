//! Camera pictures in: the first stage.
//!
//! **Enters:** a webcam (`CameraFeed::device`, feature `webcam`), a recorded clip ([`CameraFeed::clip`]), a still picture
//! ([`CameraFeed::file`]), an image of the game ([`CameraFeed::image`]) or pixels it supplies ([`CameraFeed::pixels`]).
//! **Leaves:** on the camera entity a [`CameraFrame`] (CPU pixels, shared) and a [`FrameTexture`] (the same on the GPU),
//! the picture drawn as the background, and a projection that equals the real camera's.
//!
//! # Time
//! Pictures are decoded in the background and carry the time at which they were taken. An update never waits for one: the newest
//! picture that is ready is used, older ones are dropped and counted. Programs that write files want every picture instead:
//! [`FeedPace::Lockstep`].
//!
//! # Shorter exposures
//! Pictures that got less light show what the others clip. A clip's sidecar names them, a game supplies them
//! ([`CameraFeed::with_exposure`]), a webcam on Linux takes them in turn (`DeviceOptions::shorter_exposures`). They are never shown or searched
//! for markers; [`BracketedFrames`] keeps the newest of each exposure beside the camera for [`lighting`](crate::lighting). Everything but
//! the exposure has to be the same: gain, white balance, aperture, zoom.
//!
//! # Units
//! Pictures are 8-bit sRGB. The GPU decodes them to *linear camera units*: 1.0 is the sensor's white. An [`ArCamera`]
//! draws them without tone mapping, dithering or ambient light, so that with nothing virtual in view and one screen pixel
//! per camera pixel, the output equals the input to ±1/255. The environment maps of later stages are in the same units and
//! are shown at the intensity `1 / Exposure::exposure()`, so 1.0 camera unit stays 1.0 in the frame buffer whatever the
//! camera's [`Exposure`](bevy::camera::Exposure), and lamps keep Bevy's photometric units.
//!
//! # Cost
//! One texture upload per new picture and one full-screen triangle per view. Decoding a 640 × 480 JPEG takes a background
//! thread about 5 ms.
//!
//! # Trouble
//! A source in trouble is a state, [`FeedState::Lost`], with the reason; the last good picture stays and pictures that come
//! again take over.

mod background_pass;
mod background_pipeline;
mod bracketing;
mod clip;
mod clip_source;
mod error;
mod feed;
mod feed_state;
mod frame;
mod image_feed;
mod image_file;
mod intrinsics;
mod open_feed;
mod poll;
mod prepare_backgrounds;
mod projection;
mod source;
mod upload;
#[cfg(feature = "webcam")]
mod webcam;

pub use bracketing::{BracketedFrame, BracketedFrames};
pub use clip::Clip;
pub use error::CameraError;
pub use feed::{CameraFeed, FeedPace};
pub use feed_state::{FeedState, FeedStatistics};
pub use frame::{CameraFrame, FramePixels, srgb_to_linear};
pub use intrinsics::Intrinsics;
pub use projection::{FrameFit, FrameMapping, IntrinsicsProjection};
pub use upload::FrameTexture;
#[cfg(feature = "webcam")]
pub use webcam::{DeviceEncoding, DeviceExposure, DeviceId, DeviceInfo, DeviceOptions, list_devices};

pub(crate) use poll::{ArrivingFrame, FramesAwaitTracking};

/// Old name of [`BracketedFrame`].
#[deprecated(since = "0.1.0", note = "use `BracketedFrame`")]
#[doc(hidden)]
pub type ShorterFrame = BracketedFrame;

/// Old name of [`BracketedFrames`].
#[deprecated(since = "0.1.0", note = "use `BracketedFrames`")]
#[doc(hidden)]
pub type ShorterFrames = BracketedFrames;

use crate::MirrorballSystems;
use bevy::{
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    prelude::*,
};

/// A game camera that stands where the real camera stands and shows its pictures behind everything.
///
/// Add a [`CameraFeed`] to the same entity. Required components switch off what would change the picture: tone mapping,
/// dithering and ambient light.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # fn setup(mut commands: Commands) {
/// commands.spawn((
///     ArCamera { intrinsics: Some(Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 1.0)), ..default() },
///     CameraFeed::file("desk.png"),
/// ));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Debug, Clone)]
#[require(
    Camera3d,
    Tonemapping = Tonemapping::None,
    DebandDither = DebandDither::Disabled,
    AmbientLight = AmbientLight { brightness: 0.0, ..default() },
)]
pub struct ArCamera {
    /// The real camera's intrinsics; scaled to the size of the pictures that arrive. Defaults to `None`: those that come with
    /// the pictures (a clip's sidecar has them) are taken, or else a horizontal field of view of 60° is assumed, which is good
    /// enough to see something and too coarse for good registration.
    pub intrinsics: Option<Intrinsics>,
    /// How a picture fills a view of another shape. Defaults to [`FrameFit::Cover`].
    pub fit: FrameFit,
}

/// Horizontal field of view assumed for cameras without intrinsics, in radians (60°, a common webcam).
const ASSUMED_HORIZONTAL_FOV: f32 = 60.0 * std::f32::consts::PI / 180.0;

impl ArCamera {
    /// A camera with known intrinsics.
    pub fn new(intrinsics: Intrinsics) -> Self {
        Self { intrinsics: Some(intrinsics), ..default() }
    }

    /// The intrinsics for a picture, scaled to its size: the known ones, or those that came with it, or 60° of horizontal field
    /// of view.
    pub fn intrinsics_for(&self, frame: &CameraFrame) -> Intrinsics {
        let size = frame.pixels.size;
        self.intrinsics.or(frame.intrinsics).filter(Intrinsics::is_valid).map_or_else(
            || Intrinsics::from_horizontal_fov(size, ASSUMED_HORIZONTAL_FOV),
            |known| known.scaled_to(size),
        )
    }
}

/// Takes pictures in, uploads them, draws them behind the scene and gives the camera the real camera's projection.
pub struct CameraPlugin;

impl Plugin for CameraPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.register_type::<ArCamera>()
            .register_type::<CameraFeed>()
            .register_type::<FeedState>()
            .register_type::<FeedStatistics>()
            .register_type::<CameraFrame>()
            .add_systems(
                PreUpdate,
                (
                    (poll::open_feeds, image_feed::watch_images.run_if(has_images), poll::poll_feeds)
                        .chain()
                        .in_set(MirrorballSystems::Poll),
                    (upload::allocate_frame_textures.run_if(has_images), projection::fit_projections)
                        .chain()
                        .in_set(MirrorballSystems::Show),
                ),
            );
        upload::build(app);
        background_pass::build(app);
    }
}

/// Programs that only measure may do without images.
fn has_images(images: Option<Res<Assets<Image>>>) -> bool {
    images.is_some()
}
