//! Which cubes the GPU has written.

use bevy::{platform::collections::HashMap, prelude::*};

/// Render world: what passes on the GPU have written, for stages that work only when something has changed.
///
/// Announce a cube (or any other source of a [`LiveEnvironment`](crate::prefilter::LiveEnvironment)) before the render graph
/// runs, in the frame in which it is written.
#[derive(Resource, Default)]
pub struct CubeWrites(HashMap<AssetId<Image>, u32>);

impl CubeWrites {
    /// Says that an image is written in this frame.
    pub fn announce(&mut self, image: AssetId<Image>) {
        let count = self.0.entry(image).or_default();
        *count = count.wrapping_add(1);
    }

    /// How often an image was announced, to compare with an earlier answer.
    pub fn count(&self, image: AssetId<Image>) -> u32 {
        self.0.get(&image).copied().unwrap_or_default()
    }
}
