//! Interface of marker detectors.

use super::{MarkerFamily, MarkerId, MarkerPattern, TrackingError};
use bevy::{math::DVec2, prelude::*};

/// An 8-bit gray image, rows from top to bottom.
#[derive(Clone, Copy, Debug)]
pub struct LumaView<'a> {
    pixels: &'a [u8],
    size: UVec2,
}

impl<'a> LumaView<'a> {
    /// Wraps pixels. Returns `None` unless there are exactly `width · height` of them.
    pub fn new(size: UVec2, pixels: &'a [u8]) -> Option<Self> {
        (pixels.len() == size.x as usize * size.y as usize).then_some(Self { pixels, size })
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> &'a [u8] {
        self.pixels
    }

    /// Width and height in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }
}

/// A marker detected in an image.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Debug, Clone, PartialEq)]
pub struct DetectedMarker {
    /// The family.
    pub family: MarkerFamily,
    /// Number within the family.
    pub id: u32,
    /// Corners of the square (see [`MarkerAnchor::size`](super::MarkerAnchor::size)) in pixels: top-left, top-right,
    /// bottom-right, bottom-left of the marker as it is printed upright (not of the image). Pixel centers are at
    /// halves.
    pub corners: [DVec2; 4],
    /// Number of bits that were corrected to decode the number.
    pub corrected_bits: u32,
}

impl DetectedMarker {
    /// What is printed on the marker.
    pub fn marker(&self) -> MarkerId {
        MarkerId::new(self.family, self.id)
    }
}

/// A detector of markers.
pub trait MarkerDetector: Send + Sync {
    /// Searches for markers of these families only. Called before each frame with those of the game's anchors, and
    /// tag36h11 if there are none. The default does nothing: a detector may know its family.
    ///
    /// # Errors
    /// A [`TrackingError`] if a family cannot be searched for.
    fn set_families(&mut self, _families: &[MarkerFamily]) -> Result<(), TrackingError> {
        Ok(())
    }

    /// Returns all markers in an image, searched at `1 / decimation` of its resolution (corners are refined at full
    /// resolution).
    fn detect(&mut self, image: LumaView, decimation: f32) -> Vec<DetectedMarker>;

    /// Cells of a printed marker, which are aligned with the frame for exact corners and to follow the marker. The
    /// default is `None`: then markers are detected anew in each frame, and corners are taken as they are detected.
    fn pattern(&self, _marker: MarkerId) -> Option<MarkerPattern> {
        None
    }
}
