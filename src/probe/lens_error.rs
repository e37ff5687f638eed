//! What is wrong with a lens.

use bevy::prelude::*;

/// Why a lens cannot be.
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
pub enum LensError {
    /// The field of view.
    #[error(
        "ProbeLens::Fisheye.fov_degrees is {found}; a lens of this projection shows more than 0 and at most {widest} degrees"
    )]
    FieldOfView {
        /// What was given, in degrees.
        found: f32,
        /// The widest possible, in degrees.
        widest: f32,
    },
    /// The factor of a sphere map.
    #[error(
        "ProbeLens::SphereMap.wrap is {0}; it has to be finite and above 0, and is 1 for a ball that shows all directions"
    )]
    Wrap(f32),
    /// The circle.
    #[error(
        "the circle of a ProbeLens has its center at {center} and a radius of {radius} pixels; both have to be finite, the radius above 0"
    )]
    Circle {
        /// Its center in pixels.
        center: Vec2,
        /// Its radius in pixels.
        radius: f32,
    },
    /// The camera's factor.
    #[error("LightProbeCamera.gain is {0}; each channel has to be finite and above 0")]
    Gain(Vec3),
}
