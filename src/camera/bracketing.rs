//! Pictures that got less light than the others of their feed: what a usual exposure clips, a shorter one shows.
//!
//! They are measured and never shown: no background, no markers, no environment is made of them.

use super::{CameraError, FramePixels};
use bevy::prelude::*;
use std::{sync::Arc, time::Duration};

/// A picture at a shorter exposure.
#[derive(Clone, Debug)]
pub struct BracketedFrame {
    /// The picture. Shared, never changed in place.
    pub pixels: Arc<FramePixels>,
    /// Light it got, the usual picture's being 1: above 0 and below 1.
    pub exposure: f32,
    /// When it was taken, on the clock of [`CameraFrame::captured`](super::CameraFrame::captured).
    pub captured: Duration,
}

/// The newest picture of each shorter exposure; on the camera entity once the first one has arrived.
///
/// Recorded clips name them in their [sidecar](super::Clip), webcams take them by themselves
/// (`DeviceOptions::shorter_exposures`, Linux), and a game says it of pictures it supplies. The light of the next usual picture is solved with
/// them ([`lighting`](crate::lighting)).
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
#[derive(Component, Clone, Debug, Default)]
pub struct BracketedFrames(Vec<BracketedFrame>);

/// Exposures that differ by less than this are the same, relative.
const MIN_EXPOSURE_DIFFERENCE: f32 = 0.02;
/// Most exposures that are kept; more than a series needs.
const MAX_EXPOSURES: usize = 8;

impl BracketedFrames {
    /// The pictures, in the order of their arrival.
    pub fn iter(&self) -> impl Iterator<Item = &BracketedFrame> {
        self.0.iter()
    }

    /// Takes a picture in, in place of an older one of the same exposure.
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

/// Whether pictures can have got this much light compared with the usual ones.
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
