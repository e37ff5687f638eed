//! Undistorted frames: what a camera with the same focal lengths and a perfect lens would have delivered.

use super::{
    ArCamera, CameraFeed, FramePixels, Intrinsics, distortion::BrownConrady, srgb_to_linear,
    texture_limit::LINEAR_TO_SRGB,
};
use bevy::{math::DVec2, platform::collections::HashMap, prelude::*};
use std::sync::{Arc, LazyLock, Mutex, PoisonError};

/// Undistorts frames of one lens and size: from where each pixel of the undistorted frame comes.
///
/// Feeds undistort their frames themselves. This is for games that insert a [`CameraFrame`](super::CameraFrame) of
/// their own: its pixels count as undistorted.
///
/// Pixels are blended from four neighbors in linear light, as light adds. Places that the lens does not show (at the
/// border, where it makes cushions) repeat the nearest that it does. What a barrel shows beyond the border of the
/// undistorted frame is lost.
///
/// ```
/// # use bevy::math::{UVec2, Vec2};
/// # use bevy_mirrorball::camera::{Distortion, FramePixels, Intrinsics, UndistortionMap};
/// let distortion = Distortion { k1: -0.25, ..Distortion::NONE };
/// let lens = Intrinsics { distortion, ..Intrinsics::from_horizontal_fov(UVec2::new(64, 48), 1.0) };
/// let map = UndistortionMap::new(&lens);
/// let frame = FramePixels::new(UVec2::new(64, 48), vec![90; 4 * 64 * 48]).expect("as many bytes as the size says");
/// assert_eq!(map.undistort(&frame).expect("of the size of the map").rgb8(0, 0), [90; 3]);
/// ```
#[derive(Debug)]
pub struct UndistortionMap {
    lens: Intrinsics,
    size: UVec2,
    samples: Vec<Sample>,
}

/// Place between four pixels.
#[derive(Clone, Copy, Debug)]
struct Sample {
    /// Number of the upper left pixel.
    first: u32,
    /// Weights of the right and lower neighbors, of [`WHOLE`].
    right: u16,
    lower: u16,
}

/// Sum of the weights of two neighbors.
const WHOLE: u16 = 256;

impl UndistortionMap {
    /// Computes the map for frames of the size that the intrinsics are for. At 640 × 480 pixels it takes about 5 ms and
    /// 2.5 MB.
    pub fn new(lens: &Intrinsics) -> Self {
        Self::onto(lens, &Intrinsics { distortion: super::Distortion::NONE, ..*lens })
    }

    /// The map onto frames of another pinhole camera at the same place.
    pub(super) fn onto(lens: &Intrinsics, pinhole: &Intrinsics) -> Self {
        let model = BrownConrady::from(lens.distortion);
        let max_radius = model.max_radius();
        let (focal, center) = (lens.focal.as_dvec2(), lens.center.as_dvec2());
        let last = (lens.size.as_dvec2() - 1.0).max(DVec2::ZERO);
        let sample = |x: u32, y: u32| {
            let pixel = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let point = (pixel - pinhole.center.as_dvec2()) / pinhole.focal.as_dvec2();
            let seen = center + focal * model.distort(point.clamp_length_max(max_radius));
            let units = ((seen - 0.5).clamp(DVec2::ZERO, last) * f64::from(WHOLE)).round().as_uvec2();
            // The last pixel is the right neighbor of the one before.
            let first = (units / u32::from(WHOLE)).min(lens.size.saturating_sub(UVec2::splat(2)));
            let weights = units - first * u32::from(WHOLE);
            Sample { first: first.y * lens.size.x + first.x, right: weights.x as u16, lower: weights.y as u16 }
        };
        let samples = (0..pinhole.size.y).flat_map(|y| (0..pinhole.size.x).map(move |x| (x, y)));
        Self { lens: *lens, size: pinhole.size, samples: samples.map(|(x, y)| sample(x, y)).collect() }
    }

    /// The undistorted frame. `None` unless the frame has the size of the map, at least 2 × 2 pixels.
    pub fn undistort(&self, frame: &FramePixels) -> Option<FramePixels> {
        if frame.size != self.lens.size || frame.size.min_element() < 2 {
            return None;
        }
        let row = 4 * frame.size.x as usize;
        let (linear, coded) = (&*SRGB_TO_LINEAR, LINEAR_TO_SRGB.as_slice());
        let mut rgba = vec![255; 4 * self.samples.len()];
        for (out, sample) in rgba.chunks_exact_mut(4).zip(&self.samples) {
            let upper = 4 * sample.first as usize;
            let (Some(above), Some(below)) =
                (frame.rgba.get(upper..upper + 8), frame.rgba.get(upper + row..upper + row + 8))
            else {
                continue;
            };
            let (right, lower) = (u32::from(sample.right), u32::from(sample.lower));
            let (left, higher) = (u32::from(WHOLE) - right, u32::from(WHOLE) - lower);
            let weights = [left * higher, right * higher, left * lower, right * lower];
            for channel in 0..3 {
                let light = |code: u8| u32::from(linear[usize::from(code)]);
                let sum = weights[0] * light(above[channel])
                    + weights[1] * light(above[channel + 4])
                    + weights[2] * light(below[channel])
                    + weights[3] * light(below[channel + 4]);
                out[channel] = coded[((sum + 0x8000) >> 16) as usize];
            }
        }
        Some(FramePixels { size: self.size, rgba })
    }
}

/// Linear light of each sRGB code; 65535 is white.
static SRGB_TO_LINEAR: LazyLock<[u16; 256]> =
    LazyLock::new(|| std::array::from_fn(|code| (srgb_to_linear(code as u8) * 65535.0).round() as u16));

/// Number of maps that are kept: one per camera, and some for lenses that a game compares.
const MAX_MAPS: usize = 8;

/// The maps of the lenses in use, shared with the tasks that detect markers.
#[derive(Resource, Clone, Default)]
pub(crate) struct UndistortionMaps(Arc<Mutex<Vec<Arc<UndistortionMap>>>>);

impl UndistortionMaps {
    /// Replaces pixels by undistorted ones; without a lens they stay.
    pub(crate) fn undistort(&self, pixels: &mut Arc<FramePixels>, lens: Option<&Intrinsics>) {
        if let Some(undistorted) = lens.and_then(|lens| self.map(lens).undistort(pixels)) {
            *pixels = Arc::new(undistorted);
        }
    }

    fn map(&self, lens: &Intrinsics) -> Arc<UndistortionMap> {
        let mut maps = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = maps.iter().find(|map| map.lens == *lens) {
            return known.clone();
        }
        let new = Arc::new(UndistortionMap::new(lens));
        if maps.len() >= MAX_MAPS {
            maps.remove(0);
        }
        maps.push(new.clone());
        new
    }
}

impl ArCamera {
    /// Intrinsics of the lens that frames of a size have to be undistorted for, if there is something to undistort.
    /// `of_frame` are those that came with the frame.
    pub(crate) fn distorting_lens(&self, of_frame: Option<Intrinsics>, size: UVec2) -> Option<Intrinsics> {
        let lens = self.known_intrinsics(of_frame, size)?;
        (lens.distortion != super::Distortion::NONE).then_some(lens)
    }
}

/// Opens feeds of stills again when the lens of their camera has changed: they deliver a frame only once.
pub(super) fn reopen_stills(
    mut cameras: Query<(Entity, &ArCamera, &mut CameraFeed), Changed<ArCamera>>,
    mut lenses: Local<HashMap<Entity, Option<Intrinsics>>>,
) {
    for (entity, camera, mut feed) in &mut cameras {
        let distorting = camera.intrinsics.filter(|lens| lens.distortion != super::Distortion::NONE);
        let last = lenses.insert(entity, distorting).flatten();
        if last != distorting && feed.is_still() && !feed.is_changed() {
            feed.set_changed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Distortion;

    const SIZE: UVec2 = UVec2::new(64, 48);

    fn lens(k1: f32) -> Intrinsics {
        let distortion = Distortion { k1, ..Distortion::NONE };
        Intrinsics { distortion, ..Intrinsics::new(Vec2::splat(60.0), Vec2::new(31.0, 25.0), SIZE) }
    }

    fn frame(pixel: impl Fn(u32, u32) -> [u8; 3]) -> FramePixels {
        let bytes = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y)));
        let rgba = bytes.flat_map(|(x, y)| {
            let [r, g, b] = pixel(x, y);
            [r, g, b, 255]
        });
        FramePixels::new(SIZE, rgba.collect()).expect("as many bytes as the size says")
    }

    #[test]
    fn without_distortion_every_pixel_stays() {
        let noise = frame(|x, y| [x * 37 + y * 101, x * 11 + y * 5, x * y].map(|value| value as u8));
        assert_eq!(UndistortionMap::new(&lens(0.0)).undistort(&noise).expect("fits").rgba, noise.rgba);
    }

    #[test]
    fn a_pixel_shows_what_the_lens_shows_at_its_distorted_place() {
        // Ramps in linear light, which blending reproduces.
        let coded = |light: f32| LINEAR_TO_SRGB[(light * 65535.0) as usize];
        let ramps = frame(|x, y| [coded((x as f32 + 0.5) / 64.0), coded((y as f32 + 0.5) / 48.0), 0]);
        for k1 in [-0.3, 0.2] {
            let lens = lens(k1);
            let undistorted = UndistortionMap::new(&lens).undistort(&ramps).expect("fits");
            for (x, y) in [(3, 5), (31, 25), (40, 40), (60, 2)] {
                let seen = lens.distort_pixel(Vec2::new(x as f32 + 0.5, y as f32 + 0.5));
                let seen = seen.clamp(Vec2::splat(0.5), SIZE.as_vec2() - 0.5) / SIZE.as_vec2();
                let light = undistorted.linear(x, y).truncate();
                assert!(light.distance(seen) < 0.01, "k1 {k1}: {x}, {y} shows {light} and not {seen}");
            }
        }
    }

    #[test]
    fn light_is_blended_and_not_codes() {
        let stripes = frame(|x, _| [if x % 2 == 0 { 0 } else { 255 }; 3]);
        let shifted = Intrinsics { center: Vec2::new(31.5, 25.0), distortion: Distortion::NONE, ..lens(0.0) };
        let between = UndistortionMap::onto(&lens(0.0), &shifted).undistort(&stripes).expect("fits");
        assert_eq!(between.rgb8(30, 20), [188; 3]);
    }

    #[test]
    fn frames_of_another_size_are_refused_and_maps_are_kept() {
        let maps = UndistortionMaps::default();
        let mut pixels = Arc::new(FramePixels::new(UVec2::new(2, 1), vec![7; 8]).expect("fits"));
        maps.undistort(&mut pixels, Some(&lens(-0.1)));
        assert_eq!(pixels.size, UVec2::new(2, 1));
        assert!(Arc::ptr_eq(&maps.map(&lens(-0.1)), &maps.map(&lens(-0.1))));
        for i in 0..20 {
            maps.map(&lens(0.01 * i as f32));
        }
        assert_eq!(maps.0.lock().expect("no test panicked").len(), MAX_MAPS);
    }
}
