//! Camera frames → environment cube.
//!
//! **Enters:** the frame that shows a ball or that a probe camera delivers, with what [`probe`](crate::probe) measured of it, the gains of
//! clipped light from [`lighting`](crate::lighting), and the fallback. **Leaves:** an
//! [`EnvironmentCube`](crate::environment_map::EnvironmentCube), rewritten on the GPU whenever something it depends on has changed.
//!
//! # Cost
//! One compute dispatch of 6 · 128² threads per source and frame, and a copy of the cube that keeps what was seen.
//!
//! The essay of [`probe`](crate::probe) says how the cube is made from several frames and what fills the parts that nobody sees.

mod extract;
mod unwrap_pass;

use crate::device::{self, Needs};
use bevy::prelude::*;

/// Writes the environment cube. Needs [`ProbePlugin`](crate::probe::ProbePlugin).
pub struct UnwrapPlugin;

impl Plugin for UnwrapPlugin {
    fn build(&self, _: &mut App) {}

    fn finish(&self, app: &mut App) {
        let needs = Needs {
            plugin: "UnwrapPlugin",
            purpose: "environments will not be measured",
            storage_buffers: 3,
            storage_textures: 1,
        };
        if device::can_draw(app, &needs) {
            unwrap_pass::build(app);
        }
    }
}
