//! One decoded camera picture.

use super::Intrinsics;
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// A decoded picture: 8-bit sRGB with alpha (ignored), rows from top to bottom, four bytes a pixel.
#[derive(Debug)]
pub struct FramePixels {
    /// Width and height in pixels.
    pub size: UVec2,
    /// `4 · width · height` bytes: red, green, blue, alpha; sRGB-encoded.
    pub rgba: Vec<u8>,
}

impl FramePixels {
    /// Wraps decoded bytes. `None` if their number does not match the size or the size is empty.
    pub fn new(size: UVec2, rgba: Vec<u8>) -> Option<Self> {
        let expected = 4 * size.x as usize * size.y as usize;
        (expected > 0 && rgba.len() == expected).then_some(Self { size, rgba })
    }

    /// Red, green and blue of one pixel, sRGB-encoded. Coordinates beyond the border are clamped to it.
    pub fn rgb8(&self, x: i32, y: i32) -> [u8; 3] {
        let x = x.clamp(0, self.size.x as i32 - 1) as usize;
        let y = y.clamp(0, self.size.y as i32 - 1) as usize;
        let at = 4 * (y * self.size.x as usize + x);
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2]]
    }

    /// One pixel in linear camera units: 0 is black, 1 the sensor's white. Clamped like [`rgb8`](Self::rgb8).
    pub fn linear(&self, x: i32, y: i32) -> Vec3 {
        let [r, g, b] = self.rgb8(x, y);
        Vec3::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b))
    }

    /// Luma of every pixel, sRGB-encoded as the camera gave it (ITU-R BT.601 weights), for marker detection.
    pub fn luma8(&self) -> Vec<u8> {
        self.rgba
            .chunks_exact(4)
            .map(|p| ((77 * u32::from(p[0]) + 150 * u32::from(p[1]) + 29 * u32::from(p[2]) + 128) >> 8) as u8)
            .collect()
    }
}

/// The newest picture of a camera feed; lives on the camera entity once the first one has arrived.
///
/// With a [`TrackingPlugin`](crate::tracking::TrackingPlugin) a picture appears here together with the markers found in it, so
/// that background and poses always belong together.
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(opaque, Component, Debug, Clone)]
pub struct CameraFrame {
    /// The picture. Shared, never changed in place.
    pub pixels: Arc<FramePixels>,
    /// Counts up with each new picture of this feed; numbers of dropped pictures are missing.
    pub sequence: u64,
    /// When the picture was taken, on the clock of [`Time<Real>`]; in [lockstep](super::FeedPace::Lockstep) the time of the
    /// recording.
    pub captured: Duration,
    /// Intrinsics that came with the picture (a clip's sidecar has them), if any.
    pub intrinsics: Option<Intrinsics>,
}

impl CameraFrame {
    /// A picture without intrinsics of its own.
    pub fn new(pixels: impl Into<Arc<FramePixels>>, sequence: u64, captured: Duration) -> Self {
        Self { pixels: pixels.into(), sequence, captured, intrinsics: None }
    }
}

/// Decodes one sRGB byte (IEC 61966-2-1) to linear 0…1.
pub fn srgb_to_linear(value: u8) -> f32 {
    SRGB_TO_LINEAR[usize::from(value)]
}

static SRGB_TO_LINEAR: std::sync::LazyLock<[f32; 256]> = std::sync::LazyLock::new(|| {
    std::array::from_fn(|i| {
        let s = i as f32 / 255.0;
        if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
    })
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_needs_as_many_bytes_as_its_size_says() {
        assert!(FramePixels::new(UVec2::new(2, 2), vec![0; 15]).is_none());
        assert!(FramePixels::new(UVec2::new(0, 2), vec![]).is_none());
        let frame = FramePixels::new(UVec2::new(2, 1), vec![255, 0, 0, 255, 255, 255, 255, 255]).expect("fits");
        assert_eq!(frame.luma8(), [77, 255]);
        assert_eq!(frame.linear(5, -3), Vec3::ONE);
    }

    #[test]
    fn srgb_decoding_hits_the_known_points() {
        assert_eq!(srgb_to_linear(0), 0.0);
        assert_eq!(srgb_to_linear(255), 1.0);
        assert!((srgb_to_linear(188) - 0.5029).abs() < 1e-4);
    }
}
