//! Errors in the settings of a probe camera.

use bevy::prelude::*;

/// Error in a [`ProbeLens`](super::ProbeLens) or [`LightProbeCamera`](super::LightProbeCamera).
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum LensError {
    /// The field of view is impossible for the projection.
    #[error(
        "ProbeLens::Fisheye.fov_degrees is {found}; a lens of this projection shows more than 0 and at most {widest} degrees"
    )]
    FieldOfView {
        /// The field of view given, in degrees.
        found: f32,
        /// The widest field of view possible, in degrees.
        widest: f32,
    },
    /// The factor of a sphere map is not finite and above 0.
    #[error(
        "ProbeLens::SphereMap.wrap is {0}; it has to be finite and above 0, and is 1 for a ball that shows all directions"
    )]
    Wrap(f32),
    /// The circle is not finite, or its radius is not above 0.
    #[error(
        "the circle of a ProbeLens has its center at {center} and a radius of {radius} pixels; both have to be finite, the radius above 0"
    )]
    Circle {
        /// Center of the circle, in pixels.
        center: Vec2,
        /// Radius of the circle, in pixels.
        radius: f32,
    },
    /// The gain of the camera is not finite and above 0.
    #[error("LightProbeCamera.gain is {0}; each channel has to be finite and above 0")]
    Gain(Vec3),
}
