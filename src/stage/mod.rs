//! What is real and what casts.

use bevy::prelude::*;

/// A stand-in for a real thing in the picture: never seen itself, it hides virtual objects behind it and receives their
/// shadows on the camera picture.
///
/// Put it on an entity with a mesh, or on the root of a spawned scene to make every mesh below it a phantom.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct PhantomObject {
    /// Whether it blocks light on its way to virtual objects and other phantoms. Turn off for supporting planes such as
    /// the desk: the light probe stands on them and its map already holds what they hide. Defaults to `true`.
    pub casts: bool,
    /// Whether shadows of virtual objects appear on it. Turn off for mirrors such as the probe ball. Defaults to `true`.
    pub receives: bool,
}

impl Default for PhantomObject {
    fn default() -> Self {
        Self { casts: true, receives: true }
    }
}
