//! Bracketed frames: frames with a shorter exposure than the normal frames of their camera.
//!
//! They resolve highlights that the normal exposure clips. The crate only measures them: it never draws them, searches
//! them for markers or makes environment maps of them.

use super::{CameraError, FramePixels};
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// A frame with a shorter exposure than normal.
#[derive(Reflect, Clone, Debug)]
#[reflect(Debug, Clone)]
pub struct BracketedFrame {
    /// The pixels. Shared, never changed in place.
    pub pixels: Arc<FramePixels>,
    /// Exposure relative to the normal frames, which have 1. Above 0 and below 1.
    pub exposure: f32,
    /// Time of capture, on the clock of [`CameraFrame::captured`](super::CameraFrame::captured).
    pub captured: Duration,
}

/// The newest frame of each shorter exposure. Lives on the camera entity once the first one has arrived.
///
/// Recorded clips list exposures in their [sidecar](super::Clip), webcams on Linux bracket by themselves
/// (`DeviceOptions::shorter_exposures`), and a game marks the pixels that it supplies with
/// [`CameraFeed::with_exposure`](super::CameraFeed::with_exposure). [`lighting`](crate::lighting) uses the newest ones
/// when it solves the light of the next normal frame.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{camera::{FramePixels, BracketedFrames}, prelude::*};
/// # fn supply(mut commands: Commands, camera: Entity, eighth: FramePixels) {
/// // taken at 1/240 s, the others at 1/30 s
/// commands.entity(camera).insert(CameraFeed::pixels(eighth).with_exposure(30.0 / 240.0));
/// # }
/// # fn print(cameras: Query<&BracketedFrames>) {
/// for frame in cameras.iter().flat_map(BracketedFrames::iter) {
///     println!("{} of the light, taken at {:?}", frame.exposure, frame.captured);
/// }
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Debug, Clone)]
pub struct BracketedFrames(Vec<BracketedFrame>);

/// Smallest relative difference between two exposures that are kept apart.
const MIN_EXPOSURE_DIFFERENCE: f32 = 0.02;
/// Largest number of exposures to keep; more than an exposure bracket needs.
const MAX_EXPOSURES: usize = 8;

impl BracketedFrames {
    /// Returns the frames in the order of their arrival.
    pub fn iter(&self) -> impl Iterator<Item = &BracketedFrame> {
        self.0.iter()
    }

    /// Adds a frame, in place of an older one with the same exposure.
    pub fn insert(&mut self, frame: BracketedFrame) {
        self.0.retain(|known| !known.is_same_exposure(&frame));
        self.0.push(frame);
        let surplus = self.0.len().saturating_sub(MAX_EXPOSURES);
        self.0.drain(..surplus);
    }
}

impl BracketedFrame {
    pub(crate) fn is_same_exposure(&self, other: &Self) -> bool {
        (self.exposure / other.exposure - 1.0).abs() < MIN_EXPOSURE_DIFFERENCE
    }
}

/// Returns an error unless frames can have this exposure relative to the normal ones.
pub(super) fn check_exposure(exposure: f32) -> Result<(), CameraError> {
    if is_exposure(exposure) { Ok(()) } else { Err(CameraError::Exposure(exposure)) }
}

pub(super) fn is_exposure(exposure: f32) -> bool {
    exposure > 0.0 && exposure <= 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_frame_of_each_exposure_is_kept() {
        let pixels = Arc::new(FramePixels::new(UVec2::ONE, vec![0; 4]).expect("fits"));
        let mut frames = BracketedFrames::default();
        for (exposure, at) in [(0.25, 1), (0.1, 2), (0.2501, 3)] {
            frames.insert(BracketedFrame { pixels: pixels.clone(), exposure, captured: Duration::from_secs(at) });
        }
        let kept: Vec<u64> = frames.iter().map(|frame| frame.captured.as_secs()).collect();
        assert_eq!(kept, [2, 3]);
        for i in 1..100 {
            let exposure = 1.0 / (1.0 + i as f32);
            frames.insert(BracketedFrame { pixels: pixels.clone(), exposure, captured: Duration::ZERO });
        }
        assert_eq!(frames.iter().count(), MAX_EXPOSURES);
    }
}
