//! Decoded camera frames.

use super::Intrinsics;
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// Pixels of a frame: 8-bit sRGB with alpha (ignored), rows from top to bottom, four bytes per pixel.
#[derive(TypePath, Debug)]
pub struct FramePixels {
    /// Width and height in pixels.
    pub size: UVec2,
    /// `4 · width · height` bytes: red, green, blue, alpha; sRGB-encoded.
    pub rgba: Vec<u8>,
}

impl FramePixels {
    /// Wraps decoded bytes. Returns `None` if their number does not match the size or the size is empty.
    pub fn new(size: UVec2, rgba: Vec<u8>) -> Option<Self> {
        let expected = 4 * size.x as usize * size.y as usize;
        (expected > 0 && rgba.len() == expected).then_some(Self { size, rgba })
    }

    /// Red, green and blue of a pixel, sRGB-encoded. Coordinates outside the frame are clamped to its border.
    pub fn rgb8(&self, x: i32, y: i32) -> [u8; 3] {
        let x = x.clamp(0, self.size.x as i32 - 1) as usize;
        let y = y.clamp(0, self.size.y as i32 - 1) as usize;
        let at = 4 * (y * self.size.x as usize + x);
        [self.rgba[at], self.rgba[at + 1], self.rgba[at + 2]]
    }

    /// A pixel in linear camera units: 0 is black, 1 the white of the sensor. Clamped like [`rgb8`](Self::rgb8).
    pub fn linear(&self, x: i32, y: i32) -> Vec3 {
        let [r, g, b] = self.rgb8(x, y);
        Vec3::new(srgb_to_linear(r), srgb_to_linear(g), srgb_to_linear(b))
    }

    /// Luma of every pixel for marker detection: sRGB-encoded as the camera delivers it, with the weights of ITU-R
    /// BT.601.
    pub fn luma8(&self) -> Vec<u8> {
        self.luma8_window(UVec2::ZERO, self.size)
    }

    /// [`luma8`](Self::luma8) of a part of the frame, which has to lie within it.
    pub(crate) fn luma8_window(&self, start: UVec2, size: UVec2) -> Vec<u8> {
        let [x, y, width, height, row] = [start.x, start.y, size.x, size.y, self.size.x].map(|n| n as usize);
        let rows = (y..y + height).map(|y| &self.rgba[4 * (y * row + x)..4 * (y * row + x + width)]);
        let luma = |p: &[u8]| ((77 * u32::from(p[0]) + 150 * u32::from(p[1]) + 29 * u32::from(p[2]) + 128) >> 8) as u8;
        rows.flat_map(|row| row.chunks_exact(4).map(luma)).collect()
    }
}

/// The newest frame of a camera feed. Lives on the camera entity once the first frame has arrived.
///
/// With a [`TrackingPlugin`](crate::tracking::TrackingPlugin) a frame appears here together with the markers detected
/// in it, so background and poses always belong together.
///
/// Frames of feeds are undistorted when they get here, see [`camera`](super#distortion); those that a game inserts
/// itself count as undistorted.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::CameraFrame;
/// fn look(frames: Query<&CameraFrame, Changed<CameraFrame>>) {
///     for frame in &frames {
///         info!("frame {}: {} pixels, first {:?}", frame.sequence, frame.pixels.size, frame.pixels.rgb8(0, 0));
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct CameraFrame {
    /// The pixels. Shared, never changed in place.
    pub pixels: Arc<FramePixels>,
    /// Number of the frame, which increases with each new frame of this feed. Numbers of dropped frames are skipped.
    pub sequence: u64,
    /// Time of capture, on the clock of [`Time<Real>`]. In [lockstep](super::FeedPace::Lockstep), the time within the
    /// recording.
    pub captured: Duration,
    /// Intrinsics that the source delivers with the frame, for example from the sidecar of a clip. Their distortion is
    /// that of the lens; the pixels have none any more.
    pub intrinsics: Option<Intrinsics>,
}

impl CameraFrame {
    /// A frame without intrinsics of its own.
    pub fn new(pixels: impl Into<Arc<FramePixels>>, sequence: u64, captured: Duration) -> Self {
        Self { pixels: pixels.into(), sequence, captured, intrinsics: None }
    }
}

/// Decodes an sRGB byte (IEC 61966-2-1) to a linear value in 0…1.
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
