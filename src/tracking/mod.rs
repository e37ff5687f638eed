//! Frame → marker poses → camera pose or anchor transforms.

use bevy::prelude::*;

/// A printed square marker of the family tag36h11; the entity's frame is the marker's frame.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Debug, Clone, PartialEq)]
#[require(Transform, Visibility)]
pub struct MarkerAnchor {
    /// Number of the marker in its family (tag36h11: 0…586).
    pub id: u32,
    /// Side of the printed black square in metres. Finite and above 0.
    pub size: f32,
}

impl MarkerAnchor {
    /// A marker of the family tag36h11 whose black square is `size` metres wide.
    pub fn new(id: u32, size: f32) -> Self {
        Self { id, size }
    }
}

/// On one [`MarkerAnchor`]: this anchor stays where it is and the camera moves around it.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct WorldOrigin;
/// stand-in until the tracking stage lands
#[derive(Component, Reflect, Clone, Debug, Default)]
pub struct MarkerTracking { pub camera_from_marker: Option<Isometry3d>, pub seq: Option<u64> }
impl MarkerTracking { pub fn last_seen_sequence(&self) -> Option<u64> { self.seq } }
pub struct TrackingPlugin;
impl Plugin for TrackingPlugin { fn build(&self, _: &mut App) {} }
