//! Camera frames: the first stage.
//!
//! **Enters:** a webcam (`CameraFeed::device`, feature `webcam`; in browsers `CameraFeed::browser`), a recorded clip
//! ([`CameraFeed::clip`], [`CameraFeed::clip_asset`]), an image file ([`CameraFeed::file`]), an image of the game
//! ([`CameraFeed::image`]) or pixels that it supplies ([`CameraFeed::pixels`]). **Leaves:** on the camera entity a
//! [`CameraFrame`] (CPU pixels, shared) and a [`FrameTexture`] (the same on the GPU), the frame drawn as the
//! background, and a projection that equals that of the real camera.
//!
//! # Time
//! Frames are decoded in the background and carry their time of capture. An update never waits for one: the newest
//! decoded frame is used, older ones are dropped and counted. Programs that write files want every frame instead:
//! [`FeedPace::Lockstep`].
//!
//! # Hand-over to tracking and back
//! A frame and the poses of the markers in it have to appear in the same update, or virtual objects would lag behind
//! the background. So this stage does not publish live frames itself when [`tracking`](crate::tracking) is present:
//!
//! - [`TrackingPlugin`](crate::tracking::TrackingPlugin) inserts the resource `FramesAwaitTracking`.
//! - [`MirrorballSystems::Poll`], this stage: a live frame becomes an `ArrivingFrame` on the camera entity. A newer
//!   frame replaces one that still waits, which counts as dropped.
//! - [`MirrorballSystems::Track`], tracking: the `ArrivingFrame` is taken away and searched for markers in the
//!   background. When that is finished, it returns as the [`CameraFrame`], together with the detected markers.
//! - [`MirrorballSystems::Show`], this stage again: the texture and the projection follow the new [`CameraFrame`].
//!
//! Without tracking and in lockstep a frame becomes the [`CameraFrame`] in `Poll` already; in lockstep, `Track` then
//! detects the markers before the update goes on.
//!
//! # Bracketed exposures
//! Frames with a shorter exposure resolve highlights that the normal exposure clips. The sidecar of a clip lists them,
//! a game marks them ([`CameraFeed::with_exposure`]), and webcams on Linux take them in turn
//! (`DeviceOptions::shorter_exposures`). They are never shown or searched for markers; [`BracketedFrames`] holds the
//! newest one of each exposure on the camera entity for [`lighting`](crate::lighting). Everything but the exposure has
//! to stay the same: gain, white balance, aperture and zoom.
//!
//! # Distortion
//! Frames are undistorted as a whole before anything reads them, bracketed ones too, so markers, ball, lamps and
//! background all see the pinhole camera that draws the virtual objects. The lens is the one of
//! [`ArCamera::intrinsics`], else that of the clip's sidecar, at the time when the frame becomes a [`CameraFrame`]:
//! in the background together with marker detection for live frames, else in [`MirrorballSystems::Poll`]. The
//! undistorted frame has the same size, focal lengths and principal point; what a barrel shows beyond its border is
//! lost. Frames that a game inserts itself as [`CameraFrame`] count as undistorted ([`UndistortionMap`] does it).
//! [`calibration`] measures a lens, and [`Intrinsics::open`] reads what it or other programs have measured.
//!
//! # Units
//! Frames are 8-bit sRGB. The GPU decodes them to *linear camera units*: 1.0 is the white of the sensor. An
//! [`ArCamera`] draws them without tone mapping, dithering or ambient light, so with no virtual object in view and one
//! screen pixel per camera pixel, the output equals the input to ±1/255. The environment maps of later stages use the
//! same units and are shown at the intensity `1 / Exposure::exposure()`. So 1.0 camera unit stays 1.0 in the frame
//! buffer whatever the [`Exposure`](bevy::camera::Exposure) of the camera, and lamps keep Bevy's photometric units.
//!
//! # Several cameras
//! Split screen, stereo and spectators are several [`ArCamera`]s, each with its own feed. Each is posed by the markers
//! in its own frames and shows its own frame, as background and on phantoms. A ball is measured in the frames of the
//! first camera that has seen a marker and has the ball in view, until that camera loses it
//! ([`ProbeMeasurement::camera`](crate::probe::ProbeMeasurement::camera)): its environment colors the shadows, and
//! lights the cameras that do not see the ball. Every other camera that sees the ball is lit by what its own frames
//! show, in the units of its own exposure and white balance; there, clipped light is recovered from the marker's paper
//! alone. Where one of several cameras counts (the [`Checklist`](crate::debug::Checklist), the visibility pass of the
//! [`shadows`](crate::shadows)), active ones come first, then those of a lower [`Camera::order`], then those spawned
//! earlier. A warning names each camera that has no visibility pass, and each whose shorter exposures are not used.
//!
//! Cameras without `ArCamera` see virtual objects only; [`ShowPhantoms`](crate::materials::ShowPhantoms) shows them the
//! real things too. A viewport is a view of its own, into which the frame is fitted. A
//! [`sub_camera_view`](Camera::sub_camera_view) shows its part of the frame, so that tiles make up the whole view.
//!
//! # Cost
//! One texture upload per new frame and one full-screen triangle per view. Decoding a 640 × 480 JPEG takes a
//! background thread about 5 ms.
//!
//! # Large frames
//! Frames that are larger than the device's textures (4096 to 16384 pixels along a side) are scaled down when they
//! arrive, with a warning that names both sizes. Intrinsics follow, as they do for any size of the same shape.
//!
//! # Failures
//! A source that fails is a state, [`FeedState::Lost`] or [`FeedState::Failed`], with the reason. The last good frame
//! stays until new frames arrive. [`FeedLost`] and [`FeedRecovered`] are triggered on the camera when that changes, and
//! [`any_feed_lost`] is a condition for systems.

mod background_motion_pass;
mod background_pass;
mod background_pipeline;
mod bracketing;
#[cfg(any(target_arch = "wasm32", test))]
mod browser;
pub mod calibration;
mod clip;
mod clip_asset;
mod clip_source;
mod distortion;
mod error;
mod feed;
mod feed_events;
mod feed_state;
mod frame;
mod image_feed;
mod image_file;
mod intrinsics;
mod intrinsics_check;
mod open_feed;
mod picture_effects;
mod poll;
mod posed_frame;
mod prepare_backgrounds;
mod projection;
mod rank;
mod source;
mod texture_limit;
mod undistort;
mod upload;
#[cfg(feature = "webcam")]
mod webcam;

pub use bracketing::{BracketedFrame, BracketedFrames};
#[cfg(any(target_arch = "wasm32", test))]
pub use browser::{BrowserCameraOptions, CameraFacing};
pub use clip::Clip;
pub use clip_asset::ClipAsset;
pub use distortion::Distortion;
pub use error::CameraError;
pub use feed::{CameraFeed, FeedPace};
pub use feed_events::{FeedLost, FeedRecovered, any_feed_lost};
pub use feed_state::{FeedState, FeedStatistics};
pub use frame::{CameraFrame, FramePixels, srgb_to_linear};
pub use intrinsics::Intrinsics;
pub use intrinsics_check::IntrinsicsProblem;
pub use projection::{FrameFit, FrameMapping, IntrinsicsProjection};
pub use undistort::UndistortionMap;
pub use upload::FrameTexture;
#[cfg(feature = "webcam")]
pub use webcam::{DeviceEncoding, DeviceExposure, DeviceId, DeviceInfo, DeviceOptions, list_devices};

pub(crate) use background_motion_pass::motion_of_frame;
pub(crate) use background_pass::MarksReal;
pub(crate) use clip::SidecarTracking;
pub(crate) use poll::{ArrivingFrame, FramesAwaitTracking};
pub(crate) use posed_frame::{PosedFrame, world_from_camera};
pub(crate) use rank::camera_rank;
pub(crate) use undistort::UndistortionMaps;

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
    core_pipeline::{
        prepass::NoBackgroundMotionVectors,
        tonemapping::{DebandDither, Tonemapping},
    },
    light::cluster::{ClusterConfig, ClusterZConfig},
    prelude::*,
};

/// A game camera that coincides with the real camera and draws its frames behind everything.
///
/// Add a [`CameraFeed`] to the same entity. Required components switch off everything that would change the frame:
/// tone mapping, dithering, ambient light, and motion vectors of the background, with which effects would smear it; and
/// they cluster lamps by distances on a desk.
/// What other effects do is in a table in the documentation of [`materials`](crate::materials).
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
    NoBackgroundMotionVectors,
    ClusterConfig = clusters_of_a_desk(),
)]
pub struct ArCamera {
    /// Intrinsics of the real camera, scaled to the size of the frames that arrive; those for another shape are not
    /// used. Frames of lenses with a distortion are undistorted. A warning says if the intrinsics cannot belong to the
    /// frames, see [`Intrinsics::problem`]. Defaults to `None`, which uses the intrinsics that come with the frames
    /// (from the sidecar of a clip) or else assumes a horizontal field of view of 60°. That is good enough to see
    /// something and too coarse for good registration.
    pub intrinsics: Option<Intrinsics>,
    /// Fit of a frame into a view of another shape. Defaults to [`FrameFit::Cover`].
    pub fit: FrameFit,
}

/// Clusters for lamps near by: Bevy's begin at 5 m, and spot lights of which none reaches that far would light nothing.
fn clusters_of_a_desk() -> ClusterConfig {
    let z_config = ClusterZConfig { first_slice_depth: 0.1, ..default() };
    ClusterConfig::FixedZ { total: 4096, z_slices: 24, z_config, dynamic_resizing: true }
}

/// Horizontal field of view in radians that is assumed for cameras without intrinsics (60°, a common webcam).
const ASSUMED_HORIZONTAL_FOV: f32 = 60.0 * std::f32::consts::PI / 180.0;

impl ArCamera {
    /// A camera with known intrinsics.
    pub fn new(intrinsics: Intrinsics) -> Self {
        Self { intrinsics: Some(intrinsics), ..default() }
    }

    /// Intrinsics for a frame, scaled to its size: those of the camera, else those that came with the frame, else 60°
    /// of horizontal field of view. Without distortion: a frame is undistorted when it becomes a [`CameraFrame`].
    pub fn intrinsics_for(&self, frame: &CameraFrame) -> Intrinsics {
        let size = frame.pixels.size;
        self.known_intrinsics(frame.intrinsics, size).map_or_else(
            || Intrinsics::from_horizontal_fov(size, ASSUMED_HORIZONTAL_FOV),
            |known| Intrinsics { distortion: Distortion::NONE, ..known },
        )
    }

    /// Intrinsics of the lens for frames of a size, with their distortion. `None` if they are unknown or cannot be.
    fn known_intrinsics(&self, of_frame: Option<Intrinsics>, size: UVec2) -> Option<Intrinsics> {
        let known = self.intrinsics.or(of_frame)?;
        known.problem(size).is_none_or(|problem| problem.is_bearable()).then(|| known.scaled_to(size))
    }
}

/// Receives camera frames, uploads them, draws them behind the scene and gives the game camera the projection of the
/// real one.
pub struct CameraPlugin;

impl Plugin for CameraPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        app.init_resource::<texture_limit::ReportedSizes>()
            .init_resource::<UndistortionMaps>()
            .add_observer(poll::close_feed)
            .add_systems(
                PreUpdate,
                (
                    (
                        undistort::reopen_stills,
                        poll::open_feeds,
                        image_feed::watch_images.run_if(has_images),
                        poll::keep_undistorted_brackets,
                        poll::poll_feeds,
                        feed_events::report_feeds,
                        texture_limit::limit_frames,
                    )
                        .chain()
                        .in_set(MirrorballSystems::Poll),
                    (
                        upload::allocate_frame_textures.run_if(has_images),
                        projection::fit_projections,
                        intrinsics_check::check_intrinsics,
                    )
                        .chain()
                        .in_set(MirrorballSystems::Show),
                ),
            )
            .add_systems(Last, picture_effects::warn_of_effects);
        clip_asset::build(app);
        upload::build(app);
        background_pass::build(app);
        background_motion_pass::build(app);
    }
}

/// Programs that only measure have no images.
fn has_images(images: Option<Res<Assets<Image>>>) -> bool {
    images.is_some()
}
