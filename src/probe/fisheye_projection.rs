//! Projections of fisheye lenses.

use bevy::prelude::*;
use std::f32::consts::PI;

/// Projection of a fisheye lens: the distance from the center of the image, in focal lengths, as a function of the
/// angle θ from the optical axis.
///
/// Common "fisheye" lenses are equidistant or equisolid; see the lens's data sheet.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum FisheyeProjection {
    /// The distance is θ. Up to 360°.
    #[default]
    Equidistant,
    /// The distance is 2 sin(θ/2): equal solid angles have equal areas. Up to 360°.
    Equisolid,
    /// The distance is 2 tan(θ/2): circles stay circles. Below 360°; at most 350° are accepted.
    Stereographic,
    /// The distance is sin θ. Up to 180°.
    Orthographic,
}

impl FisheyeProjection {
    /// Widest field of view of a lens with this projection, in degrees.
    pub fn widest_degrees(self) -> f32 {
        match self {
            Self::Equidistant | Self::Equisolid => 360.0,
            Self::Stereographic => 350.0,
            Self::Orthographic => 180.0,
        }
    }

    /// Distance from the center, in focal lengths, of an angle from the axis in radians.
    pub fn radius(self, angle: f32) -> f32 {
        match self {
            Self::Equidistant => angle,
            Self::Equisolid => 2.0 * (0.5 * angle).sin(),
            Self::Stereographic => 2.0 * (0.5 * angle).min(1.57).tan(),
            Self::Orthographic => angle.min(0.5 * PI).sin(),
        }
    }

    /// Angle from the axis, in radians, of a distance from the center in focal lengths. Inverse of
    /// [`radius`](Self::radius).
    pub fn angle(self, radius: f32) -> f32 {
        match self {
            Self::Equidistant => radius,
            Self::Equisolid => 2.0 * (0.5 * radius).clamp(-1.0, 1.0).asin(),
            Self::Stereographic => 2.0 * (0.5 * radius).atan(),
            Self::Orthographic => radius.clamp(-1.0, 1.0).asin(),
        }
    }

    pub(super) fn one_hot(self) -> Vec4 {
        match self {
            Self::Equidistant => Vec4::X,
            Self::Equisolid => Vec4::Y,
            Self::Stereographic => Vec4::Z,
            Self::Orthographic => Vec4::W,
        }
    }
}
