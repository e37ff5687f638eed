//! Announcements of cubes that the GPU writes.

use bevy::{platform::collections::HashMap, prelude::*};

/// Images that passes on the GPU have written, for stages that work only when something has changed. A resource of
/// the render world.
///
/// Announce a cube, or any other source of a [`LiveEnvironment`](crate::prefilter::LiveEnvironment), in the frame in
/// which it is written, before the render graph runs.
#[derive(Resource, Reflect, Default)]
#[reflect(Resource, Default)]
pub struct CubeWrites(HashMap<AssetId<Image>, u32>);

impl CubeWrites {
    /// Announces that an image is written in this frame.
    pub fn announce(&mut self, image: AssetId<Image>) {
        let count = self.0.entry(image).or_default();
        *count = count.wrapping_add(1);
    }

    /// Forgets images that no longer exist.
    pub(crate) fn retain(&mut self, exists: impl Fn(AssetId<Image>) -> bool) {
        self.0.retain(|image, _| exists(*image));
    }

    /// Number of announcements of an image, to be compared with an earlier number.
    pub fn count(&self, image: AssetId<Image>) -> u32 {
        self.0.get(&image).copied().unwrap_or_default()
    }
}
