//! The component of a dome, its settings and what it reports.

use super::filter::ShadowFilter;
use bevy::prelude::*;

/// A dome of shadow-casting directions colored by the measured environment; its up axis is the entity's +Y.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prelude::*;
/// # use bevy_mirrorball::shadows::ShadowFilter;
/// # fn setup(mut commands: Commands) {
/// commands.spawn(ShadowDomeLight { directions: 128, filter: ShadowFilter::Gauss, ..default() });
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, DomeState)]
pub struct ShadowDomeLight {
    /// Number of directions with shadow maps, 1…1024 (clamped), spread evenly over what `coverage` says. A single one
    /// points along the entity's +Y: the hand-placed light. Defaults to 64.
    pub directions: u32,
    /// Where the directions are. Defaults to the hemisphere above.
    pub coverage: DomeCoverage,
    /// How many of the strongest [`RealLight`]s have shadow maps of their own, twice as fine, with
    /// penumbras as wide as the light is, 0…8 (clamped). Their part of the environment's light is taken from the directions
    /// around them. Defaults to 2.
    pub key_lights: u32,
    /// Side of one direction's square shadow map in texels, 32…1024 (clamped; halved until the atlas fits the device's largest texture).
    /// Defaults to 256.
    pub resolution: u32,
    /// How shadow maps are read. Defaults to bilinear: where many directions meet, their sum is smooth.
    pub filter: ShadowFilter,
    /// Where visibility is computed. Defaults to every second pixel in both directions, interleaved.
    pub samples: VisibilitySamples,
    /// Directions whose shadow maps are drawn again in a frame in which casters move, 1 or more; raised where otherwise
    /// one of the directions that give 90 % of the light would wait for more than eight frames. Defaults to 16.
    pub refreshed_per_frame: u32,
    /// Share of the dome's light, 0…1, whose directions are taken as unobstructed without a look at their shadow maps: the
    /// dimmest ones. Defaults to 0.005.
    pub dim_share: f32,
    /// Whether shadows also darken what virtual surfaces mirror of the environment, estimated from the diffuse light that
    /// is missing. Defaults to `false`.
    pub occludes_reflections: bool,
}

impl Default for ShadowDomeLight {
    fn default() -> Self {
        Self {
            directions: 64,
            coverage: DomeCoverage::default(),
            key_lights: 2,
            resolution: 256,
            filter: ShadowFilter::default(),
            samples: VisibilitySamples::default(),
            refreshed_per_frame: 16,
            dim_share: 0.005,
            occludes_reflections: false,
        }
    }
}

impl ShadowDomeLight {
    /// Most directions a dome can have.
    pub const MAX_DIRECTIONS: u32 = 1024;

    /// Most key lights a dome can have.
    pub const MAX_KEY_LIGHTS: u32 = 8;

    /// The number of directions within its bounds.
    pub(super) fn clamped_directions(&self) -> u32 {
        self.directions.clamp(1, Self::MAX_DIRECTIONS)
    }
}

/// Where a dome has shadow maps.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum DomeCoverage {
    /// Above the horizon; what comes from below is the light of the desk on which everything stands.
    #[default]
    Hemisphere,
    /// All around, for things that float or hang.
    Sphere,
}

/// Where the sum over all directions is computed.
///
/// All but the last need a depth and normal prepass, which is added to the camera they serve: the first active
/// [`ArCamera`](crate::camera::ArCamera), without one the first active `Camera3d`. Fragments that no sample belongs to (thin
/// things, transparent ones) and those of all other cameras compute it themselves.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
pub enum VisibilitySamples {
    /// As [`Half`](Self::Half); but each sample sums up a quarter of the directions (and all key lights) and has the rest from
    /// its neighbors on the same surface. Things thinner than six pixels are the less exact for it.
    #[default]
    Interleaved,
    /// At every second pixel in both directions, interpolated along surfaces.
    Half,
    /// At every pixel.
    Full,
    /// In every fragment that materials draw, without a prepass. Exact and slow.
    Fragment,
}

impl VisibilitySamples {
    /// Pixels across one sample; 0 without samples.
    pub(super) fn pixels(self) -> u32 {
        match self {
            Self::Interleaved | Self::Half => 2,
            Self::Full => 1,
            Self::Fragment => 0,
        }
    }
}

/// What a [`ShadowDomeLight`] did in the last frame.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct DomeState {
    /// Number of meshes that cast.
    pub casters: u32,
    /// Directions whose shadow maps were drawn in this frame.
    pub redrawn: u32,
    /// Directions whose shadow maps show casters where they no longer are.
    pub outdated: u32,
    /// The fewest directions that together give 90 % of the light, as it was read back from the GPU some frames ago.
    pub main: u32,
    /// Real lights that have shadow maps of their own.
    pub key_lights: u32,
    /// Frames since casters were last where the oldest of the main directions' shadow maps shows them.
    pub oldest_main: u32,
}
