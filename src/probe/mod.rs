//! Frame + ball pose → raw environment cube.

mod mirror_ball;

pub use mirror_ball::{BallView, Ellipse};

use bevy::prelude::*;

/// A mirrored ball standing in the real scene; its center is the entity's origin.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct LightProbeSphere {
    /// Radius in metres. Finite and above 0. Defaults to 0.05.
    pub radius: f32,
    /// Share of the light the ball mirrors, 0…1 (exclusive of 0); the picture is divided by it. Polished chrome about
    /// 0.65, silvered glass about 0.9. Defaults to 0.9.
    pub reflectance: f32,
}

impl Default for LightProbeSphere {
    fn default() -> Self {
        Self { radius: 0.05, reflectance: 0.9 }
    }
}
