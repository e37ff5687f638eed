//! Gains on clipped light, handed from the recovery to the unwrap pass.

use bevy::prelude::*;
use std::sync::Arc;

/// Gain on clipped light per direction, on the entity of a probe. Replaces the single gain of the probe's measurement.
#[derive(Component, Clone)]
pub(crate) struct ClipGains(pub(crate) Arc<Vec<Vec4>>);

impl ClipGains {
    /// Cells along an edge of the cube of gains, as in the shader, in the order of
    /// [`cube_directions`](crate::environment_map::cube_directions).
    pub(crate) const EDGE: u32 = super::solver::CELLS_PER_EDGE;
    /// Number of gains.
    pub(crate) const COUNT: usize = 6 * (Self::EDGE * Self::EDGE) as usize;
}

/// Lists are never changed in place: two components are equal if they share one list.
impl PartialEq for ClipGains {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
