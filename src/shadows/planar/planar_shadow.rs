//! Components of planar shadows.

use bevy::prelude::*;

/// Shadows on a flat receiver, each caster projected onto it (*planar shadows*): the cheapest kind, without any shadow
/// map, and without a [`ShadowDomeLight`](crate::shadows::ShadowDomeLight).
///
/// The receiver is a rectangle in the plane of the entity's x and z axes, seen from +Y. What is drawn there is
/// multiplied by the fraction of light that is left, per color: on a real desk (a phantom) the camera's frame, on a
/// virtual floor the shaded surface. Drawn into a texture whenever lights or casters change.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::shadows::{PlanarLight, PlanarLights, PlanarShadow};
/// # fn setup(mut commands: Commands) {
/// // soft shadows of the three strongest real lights, on 1.6 × 1.2 m of a real desk
/// commands.spawn(PlanarShadow { half_size: Vec2::new(0.8, 0.6), ..default() });
/// // one hard shadow of a lamp that takes 70 % of the light
/// let lamp = PlanarLight::point(Vec3::new(0.5, 1.0, 0.2), 0.0).with_share(LinearRgba::gray(0.7));
/// commands.spawn(PlanarShadow { lights: PlanarLights::Placed(vec![lamp]), ambient: 0, ..default() });
/// # }
/// ```
///
/// The methods are those of Blinn 1988, and of Karlsson and Selegård 2005 for soft shadows.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, PlanarShadowState)]
pub struct PlanarShadow {
    /// Half the size of the receiver along x and z, in meters, above 0; scaled by the transform. Defaults to 0.5 m.
    pub half_size: Vec2,
    /// Where the shadows come from. Defaults to the three strongest real lights.
    pub lights: PlanarLights,
    /// What casts them. Defaults to virtual things only, as a real receiver needs.
    pub casters: PlanarCasters,
    /// Number of points on each light, 1…64 (clamped; the next lower square number is used). 1 makes hard shadows of
    /// the lights' centers. Defaults to 25, which the blur between them smooths.
    pub samples: u32,
    /// Number of directions from which the rest of the light comes, 0…128 (clamped), which makes the soft shadows of a
    /// dull day, and those right below things. With 0 that light has no shadows. Defaults to 32; 64 show no steps.
    pub ambient: u32,
    /// Edge of the texture in texels, 32…2048 (clamped). It covers no more of the receiver than the shadows. Defaults
    /// to 512.
    pub resolution: u32,
    /// Depth of the shadows, 0…1 (clamped): 1 takes all that the light gives. Defaults to 1.
    pub strength: f32,
    /// Height above the surface at which the shadows are drawn, in meters along +Y. Nothing lower casts. Defaults to
    /// 0.001, against flickering with the surface beneath.
    pub offset: f32,
}

impl PlanarShadow {
    /// Largest number of points on each light.
    pub const MAX_SAMPLES: u32 = 64;
    /// Largest number of directions of the rest of the light.
    pub const MAX_AMBIENT: u32 = 128;
    /// Smallest and largest edge of the texture in texels.
    pub const RESOLUTIONS: [u32; 2] = [32, 2048];
}

impl Default for PlanarShadow {
    fn default() -> Self {
        Self {
            half_size: Vec2::splat(0.5),
            lights: PlanarLights::default(),
            casters: PlanarCasters::default(),
            samples: 25,
            ambient: 32,
            resolution: 512,
            strength: 1.0,
            offset: 0.001,
        }
    }
}

/// Lights of a [`PlanarShadow`].
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PlanarLights {
    /// The strongest [`RealLight`](crate::lighting::RealLight)s at the receiver, at most this many, at most 16. What
    /// each gives is compared with all light that falls onto the receiver by the filtered environment of the camera
    /// ([`LiveEnvironment`](crate::prefilter::LiveEnvironment)); without one, the light's own
    /// [`fraction`](crate::lighting::RealLight::fraction) counts.
    Real(u32),
    /// Lights placed by hand, in world space; the first 16 of them.
    Placed(Vec<PlanarLight>),
}

impl PlanarLights {
    /// Largest number of lights of a receiver.
    pub const MAX: u32 = 16;
}

impl Default for PlanarLights {
    fn default() -> Self {
        Self::Real(3)
    }
}

/// A light of a planar shadow that is placed by hand.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct PlanarLight {
    /// Where it is.
    pub place: PlanarLightPlace,
    /// Half of the angle that it subtends, seen from the middle of the receiver, in radians, 0…1 (clamped).
    pub angular_radius: f32,
    /// Share of the light on the receiver that it gives, linear, 0…1 per channel (clamped). A gray of 1 has black
    /// shadows.
    pub share: LinearRgba,
}

/// Place of a light.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub enum PlanarLightPlace {
    /// Far away in this direction, world space.
    Direction(Dir3),
    /// At this position, world space, meters.
    Point(Vec3),
}

impl PlanarLight {
    /// A distant light that gives half of the light. `direction` points towards it.
    pub fn distant(direction: Dir3, angular_radius: f32) -> Self {
        Self { place: PlanarLightPlace::Direction(direction), angular_radius, share: LinearRgba::gray(0.5) }
    }

    /// A near light that gives half of the light.
    pub fn point(position: Vec3, angular_radius: f32) -> Self {
        Self { place: PlanarLightPlace::Point(position), angular_radius, share: LinearRgba::gray(0.5) }
    }

    /// The same light with another share, see [`share`](Self::share).
    pub fn with_share(self, share: LinearRgba) -> Self {
        Self { share, ..self }
    }
}

/// What casts planar shadows.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Debug, Clone, PartialEq)]
pub enum PlanarCasters {
    /// Virtual things: the frame of a camera has the shadows of real things already.
    #[default]
    Virtual,
    /// Phantoms too, on virtual receivers.
    All,
}

/// A simpler mesh that casts planar shadows in place of the entity's own: a box for a bush, say. It is neither skinned
/// nor morphed.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
pub struct PlanarStandIn(pub Handle<Mesh>);

/// What a [`PlanarShadow`] draws.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct PlanarShadowState {
    /// Number of lights above the receiver.
    pub lights: u32,
    /// Number of meshes that cast.
    pub casters: u32,
    /// How often lights or casters have changed, so that the shadows were drawn again.
    pub drawings: u32,
}
