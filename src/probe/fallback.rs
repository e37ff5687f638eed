//! Fallback light while nothing has been measured: its settings and state.

use super::sky_gradient::SkyGradient;
use bevy::prelude::*;
use std::{path::PathBuf, time::Duration};

/// Fallback environment, which lights the scene of an [`ArCamera`](crate::camera::ArCamera) until a probe has been
/// seen. Virtual objects are thus never black, and a game works without any ball.
///
/// Every `ArCamera` has one. If it is removed when the camera is spawned, there is no light before a measurement.
/// Cameras spawned with their own [`EnvironmentMapLight`](bevy::light::EnvironmentMapLight) or
/// [`LiveEnvironment`](crate::prefilter::LiveEnvironment) keep it.
///
/// The light is the first that exists of: [`saved`](Self::saved), [`file`](Self::file), a sky fitted to the camera's
/// frame and the marker's paper, a uniform gray. [`EnvironmentOrigin`] on the same entity reports which.
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
    /// ([`EquirectPixels::save`](crate::environment_map::EquirectPixels::save)), in camera units and world axes. The
    /// file may be missing. Defaults to `None`.
    pub saved: Option<PathBuf>,
    /// Another such file, for the first run of the game. A relative path that does not exist in the working directory
    /// starts where Bevy's file assets do, as those of [`CameraFeed`](crate::camera::CameraFeed#paths). A file that
    /// cannot be read causes a warning. Defaults to `None`.
    pub file: Option<PathBuf>,
    /// Duration of the transition to the measured environment. With a feed in
    /// [lockstep](crate::camera::FeedPace::Lockstep) the transition is immediate. Defaults to half a second.
    pub fade: Duration,
}

impl Default for EnvironmentFallback {
    fn default() -> Self {
        Self { saved: None, file: None, fade: Duration::from_millis(500) }
    }
}

/// Origin of the light in the scene of an [`ArCamera`](crate::camera::ArCamera).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::EnvironmentOrigin};
/// fn is_measured(origins: Query<&EnvironmentOrigin, With<ArCamera>>) -> bool {
///     origins.iter().all(|origin| *origin == EnvironmentOrigin::Measured)
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Component, Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum EnvironmentOrigin {
    /// A uniform gray, because nothing is known.
    #[default]
    Unknown,
    /// A sky fitted to the camera's frame, and to the marker's paper if it is in view.
    FittedSky,
    /// The file [`EnvironmentFallback::file`].
    File,
    /// The file [`EnvironmentFallback::saved`].
    Saved,
    /// A ball or a probe camera. A measured environment stays until something new is measured.
    Measured,
}

impl EnvironmentOrigin {
    /// Sorts origins by how much is known of the light.
    pub(crate) fn knowledge(self) -> u8 {
        match self {
            Self::Unknown => 0,
            Self::FittedSky => 1,
            Self::File => 2,
            Self::Saved => 3,
            Self::Measured => 4,
        }
    }
}

/// Equirectangular texture of the fallback, on the entity of the [`EnvironmentFallback`] while it is in use.
#[derive(Component, Clone, Debug)]
pub(crate) struct FallbackImage {
    pub image: Handle<Image>,
    pub size: UVec2,
    /// Counter that is incremented when the texture changes.
    pub version: u32,
    /// Fraction of the transition to the measured environment that is over, 0…1.
    pub measured_fraction: f32,
    pub(super) gradient: Option<SkyGradient>,
    pub(super) measured_since: Option<Duration>,
}

impl FallbackImage {
    pub(super) fn new(image: Handle<Image>, size: UVec2, version: u32, gradient: Option<SkyGradient>) -> Self {
        Self { image, size, version, measured_fraction: 0.0, gradient, measured_since: None }
    }
}
