//! The component [`ShadowDomeLight`], its settings, and the state that it reports.

use super::{filter::ShadowFilter, pass_times::DomeTimes};
use bevy::prelude::*;

/// Dome of shadow-casting directions colored by the measured environment. The up axis of the dome is the entity's +Y.
///
/// As with Bevy's lights, meshes cast shadows if their `RenderLayers` share a layer with those of the dome; without the
/// component, both are on layer 0. A mesh that casts and is not seen is on a layer of the dome that no camera has.
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
    /// Number of directions with shadow maps, 1…1024 (clamped), spread evenly over the `coverage`. A single direction
    /// points along the entity's +Y, for a light placed by hand. Defaults to 64.
    ///
    /// The shadow of something small on a far wall falls apart into one spot per direction. In a room, 64 directions
    /// leave spots of up to 4/255, 160 of up to 2/255 (example `shadow_lab`).
    ///
    /// Each costs 8 · `resolution`² bytes and, where something moves, a lookup per sample and kind of caster, virtual
    /// or phantom. The number of draw calls does not depend on it.
    pub directions: u32,
    /// Part of the sphere over which the directions are spread. Defaults to the upper hemisphere.
    pub coverage: DomeCoverage,
    /// Maximum number of key lights, 0…8 (clamped): the strongest [`RealLight`](crate::lighting::RealLight)s, which
    /// have their own shadow maps with twice the resolution and a penumbra as wide as the light requires. Their part
    /// of the environment's light is taken from the directions around them. Defaults to 2.
    ///
    /// A free place costs its shadow map, the memory of four directions. A taken one costs up to 32 lookups per sample,
    /// and is redrawn whenever its light moves.
    pub key_lights: u32,
    /// Edge of one direction's square shadow map in texels, 32…1024 (clamped). It is halved until the atlas is at most
    /// 8192 texels wide and high, or as large as the device's largest texture if that is smaller. Defaults to 256. The
    /// time of a lookup hardly depends on it, the memory on its square.
    pub resolution: u32,
    /// Filter of the shadow maps. Defaults to bilinear, because the sum over many directions is smooth anyway.
    /// Lookups take as much longer as it compares more texels.
    pub filter: ShadowFilter,
    /// Positions at which visibility is computed. Defaults to every second pixel in both directions, interleaved.
    pub samples: VisibilitySamples,
    /// Number of shadow maps to redraw in a frame in which casters move, at least 1. It is raised if one of the
    /// directions that give 90 % of the light would otherwise wait for more than eight frames. Defaults to 16. The time
    /// of drawing shadow maps is proportional to it and to the triangles of all casters.
    pub refreshed_per_frame: u32,
    /// Fraction of the dome's light to leave unshadowed, 0…1 (clamped; 0 if not finite). The dimmest directions, up to
    /// this fraction in total, skip their shadow-map lookup. Defaults to 0.005. Under a uniform sky it saves nothing,
    /// in a room with bright lamps many lookups.
    pub dim_share: f32,
    /// Maximum number of surfels, small discs on virtual and real surfaces that send bounced light to each other,
    /// 0…1024 (clamped). Defaults to 512. 0 leaves bounced light out: what hides the sky is then black if it is
    /// virtual, and as bright as the map below the horizon if it is real. The time of the visibility pass grows with
    /// it.
    pub surfels: u32,
    /// Whether shadows also darken reflections of the environment on virtual surfaces. The amount is estimated from the
    /// missing diffuse light. Defaults to `false`.
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
            surfels: 512,
            occludes_reflections: false,
        }
    }
}

impl ShadowDomeLight {
    /// Maximum number of directions of a dome.
    pub const MAX_DIRECTIONS: u32 = 1024;

    /// Maximum number of key lights of a dome.
    pub const MAX_KEY_LIGHTS: u32 = 8;

    /// Maximum number of surfels of a dome.
    pub const MAX_SURFELS: u32 = 1024;

    /// Returns the number of directions, clamped to its range.
    pub(super) fn clamped_directions(&self) -> u32 {
        self.directions.clamp(1, Self::MAX_DIRECTIONS)
    }

    /// Returns the maximum number of surfels, clamped to its range.
    pub(super) fn clamped_surfels(&self) -> u32 {
        self.surfels.min(Self::MAX_SURFELS)
    }
}

/// Part of the sphere in which a dome has shadow maps.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum DomeCoverage {
    /// Above the horizon. Light from below comes from the desk on which everything stands.
    #[default]
    Hemisphere,
    /// The whole sphere, for objects that float or hang.
    Sphere,
}

/// Positions at which visibility is summed over all directions.
///
/// All variants except [`Fragment`](Self::Fragment) need a depth and normal prepass. The crate adds it to the camera
/// with the visibility pass: the first active [`ArCamera`](crate::camera::ArCamera), or the first active `Camera3d`
/// if there is none. Fragments of that camera without a matching sample, on things thinner than a sample, take those of
/// the most similar surfaces within eight pixels. Transparent objects and all other cameras compute the sum in every
/// fragment; so does everything that an opaque prepass shows while a camera without the pass has both prepasses.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum VisibilitySamples {
    /// Like [`Half`](Self::Half), but each sample sums over a quarter of the directions (and all key lights) and
    /// takes the rest from its neighbors on the same surface. Geometry thinner than six pixels gets less accurate
    /// shadows.
    #[default]
    Interleaved,
    /// One sample per 2 × 2 pixels, interpolated along surfaces.
    Half,
    /// One sample per pixel.
    Full,
    /// The sum is computed in every fragment that materials draw, without a prepass. Exact and slow.
    Fragment,
}

impl VisibilitySamples {
    /// Returns the width of one sample in pixels, or 0 without samples.
    pub(super) fn pixels(self) -> u32 {
        match self {
            Self::Interleaved | Self::Half => 2,
            Self::Full => 1,
            Self::Fragment => 0,
        }
    }
}

/// State of a [`ShadowDomeLight`] in the last frame. Required by it; written by the crate.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::shadows::DomeState;
/// fn is_up_to_date(domes: Query<&DomeState>) -> bool {
///     domes.iter().all(|dome| dome.outdated == 0)
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct DomeState {
    /// Number of meshes that cast shadows.
    pub casters: u32,
    /// Number of directions whose shadow maps were redrawn in this frame.
    pub redrawn: u32,
    /// Number of directions whose shadow maps show casters at old positions.
    pub outdated: u32,
    /// Number of main directions: the smallest set that gives 90 % of the light, which is read back from the GPU with
    /// a delay of some frames.
    pub main: u32,
    /// Number of real lights that have their own shadow maps.
    pub key_lights: u32,
    /// Age of the oldest shadow map of the main directions: frames since the casters were where it shows them.
    pub oldest_main: u32,
    /// What the dome costs on the GPU.
    pub milliseconds: DomeTimes,
}
