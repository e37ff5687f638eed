//! What a game asks of the browser's camera.

use glam::UVec2;

/// Side of the device on which a camera is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CameraFacing {
    /// The camera on the back of a phone or tablet, which sees the room.
    #[default]
    Environment,
    /// The camera on the side of the screen, which sees the user. Its frames are not mirrored.
    User,
}

/// A camera of the browser and the settings requested from it.
///
/// The browser asks the user for permission. All requests but [`device_id`](Self::device_id) are wishes: the browser
/// delivers what comes nearest, and a laptop with a single camera uses that one whichever way it faces.
///
/// ```
/// # use bevy::prelude::*;
/// # #[cfg(target_arch = "wasm32")] {
/// # use bevy_mirrorball::camera::{BrowserCameraOptions, CameraFacing};
/// let options = BrowserCameraOptions { facing: CameraFacing::User, size: UVec2::new(1280, 720), ..default() };
/// # }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BrowserCameraOptions {
    /// Side of the device on which the camera is. Ignored if there is a [`device_id`](Self::device_id). Defaults to
    /// [`CameraFacing::Environment`].
    pub facing: CameraFacing,
    /// The camera with this `deviceId`, and no other one, as JavaScript's `navigator.mediaDevices.enumerateDevices()`
    /// lists it. Such ids are different for each site, and the list has them only once the user has permitted a
    /// camera. An empty one counts as `None`. Defaults to `None`: the browser or the user chooses.
    pub device_id: Option<String>,
    /// Requested width and height in pixels, 1 to 8192 each; other values are clamped. Phones that are held upright
    /// deliver the upright size, 480 × 640 instead of 640 × 480, and the size changes when the phone is turned.
    /// Defaults to 640 × 480.
    pub size: UVec2,
    /// Requested frames per second. Values that are not finite and positive count as `None`. Defaults to `None`: the
    /// browser chooses, mostly 30.
    pub frame_rate: Option<f32>,
    /// Whether the exposure stays what it is one second after the camera has started, so that measured light is
    /// comparable from frame to frame. Chrome can do that with most cameras. Where it is not possible, or the picture
    /// becomes another one by it, a warning is logged and the exposure stays automatic. Defaults to `true`.
    pub locks_exposure: bool,
    /// Whether the white balance stays what it is after the exposure was locked, like
    /// [`locks_exposure`](Self::locks_exposure). Defaults to `true`.
    pub locks_white_balance: bool,
}

impl Default for BrowserCameraOptions {
    fn default() -> Self {
        Self {
            facing: CameraFacing::default(),
            device_id: None,
            size: UVec2::new(640, 480),
            frame_rate: None,
            locks_exposure: true,
            locks_white_balance: true,
        }
    }
}

/// Largest width and height of frames in pixels: 256 MiB a frame. No camera of a browser has more.
pub(super) const MAX_SIDE: u32 = 8192;

impl BrowserCameraOptions {
    pub(super) fn wished_size(&self) -> UVec2 {
        self.size.clamp(UVec2::ONE, UVec2::splat(MAX_SIDE))
    }

    pub(super) fn wished_frame_rate(&self) -> Option<f32> {
        self.frame_rate.filter(|rate| rate.is_finite() && *rate > 0.0)
    }

    pub(super) fn wished_device(&self) -> Option<&str> {
        self.device_id.as_deref().filter(|id| !id.is_empty())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_out_of_range_are_clamped_or_dropped() {
        let odd = BrowserCameraOptions {
            device_id: Some(String::new()),
            size: UVec2::new(0, u32::MAX),
            frame_rate: Some(f32::NAN),
            ..Default::default()
        };
        assert_eq!(odd.wished_size(), UVec2::new(1, 8192));
        assert_eq!((odd.wished_frame_rate(), odd.wished_device()), (None, None));
        let negative = BrowserCameraOptions { frame_rate: Some(-1.0), ..Default::default() };
        assert_eq!(negative.wished_frame_rate(), None);
    }
}
