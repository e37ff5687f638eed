//! Light while nothing has been measured: the map saved last, a file, or a sky fitted to what the camera shows.

use super::sky_gradient::SkyGradient;
use bevy::prelude::*;
use std::{path::PathBuf, time::Duration};

/// What lights the scene of an [`ArCamera`](crate::camera::ArCamera) as long as no probe has been seen, so that virtual things are never black and a game
/// works without any ball. Every camera has one; removed when the camera is spawned, there is no light before a measurement.
/// Cameras spawned with an [`EnvironmentMapLight`](bevy::light::EnvironmentMapLight) or a
/// [`LiveEnvironment`](crate::prefilter::LiveEnvironment) of the game's own keep that.
///
/// The first of these that exists: [`saved`](Self::saved), [`file`](Self::file), a sky fitted to the camera's picture and the
/// marker's paper, an even gray. [`EnvironmentOrigin`] beside it says which.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::EnvironmentFallback};
/// # fn setup(mut commands: Commands) {
/// let fallback = EnvironmentFallback { file: Some("assets/studio.hdr".into()), ..default() };
/// commands.spawn((ArCamera::default(), CameraFeed::clip("assets/desk_clip"), fallback));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(EnvironmentOrigin)]
pub struct EnvironmentFallback {
    /// Equirectangular Radiance or OpenEXR file that the game wrote when it last ran
    /// ([`EquirectPixels::save`](crate::environment_map::EquirectPixels::save)), camera units, world axes. It may be missing. Defaults to
    /// `None`.
    pub saved: Option<PathBuf>,
    /// Another such file, for the first time. A file that cannot be read is a warning. Defaults to `None`.
    pub file: Option<PathBuf>,
    /// How long the measured environment takes to replace it; with a feed in [lockstep](crate::camera::FeedPace::Lockstep) it does so at once.
    /// Defaults to half a second.
    pub fade: Duration,
}

impl Default for EnvironmentFallback {
    fn default() -> Self {
        Self { saved: None, file: None, fade: Duration::from_millis(500) }
    }
}

/// Where the light of an [`ArCamera`](crate::camera::ArCamera)'s scene comes from.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Component, Default, Debug, Clone, PartialEq, Hash)]
pub enum EnvironmentOrigin {
    /// An even gray: nothing is known.
    #[default]
    Unknown,
    /// A sky fitted to the camera's picture, and to the marker's paper if it is in view.
    FittedSky,
    /// [`EnvironmentFallback::file`].
    File,
    /// [`EnvironmentFallback::saved`].
    Saved,
    /// A ball or a probe camera. Once measured, an environment stays until something new is measured.
    Measured,
}

/// The fallback as an equirectangular texture, beside the [`EnvironmentFallback`] while it is used.
#[derive(Component, Clone, Debug)]
pub(crate) struct FallbackImage {
    pub image: Handle<Image>,
    pub size: UVec2,
    /// Counts up when the texture changes.
    pub version: u32,
    /// Part of the way to the measured environment that is gone, 0…1.
    pub measured_fraction: f32,
    pub(super) gradient: Option<SkyGradient>,
    pub(super) measured_since: Option<Duration>,
}

impl FallbackImage {
    pub(super) fn new(image: Handle<Image>, size: UVec2, version: u32, gradient: Option<SkyGradient>) -> Self {
        Self { image, size, version, measured_fraction: 0.0, gradient, measured_since: None }
    }
}
