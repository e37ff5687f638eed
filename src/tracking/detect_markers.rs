//! Marker detection in a frame, with corners refined in linear light.

use super::{DetectedMarker, LumaView, MarkerDetector};
use crate::{camera::FramePixels, luminance::luminance};
use glam::{DVec2, UVec2};

/// Side of the window around a marker, as a multiple of the size of the marker.
const WINDOW_SIZE: f64 = 2.3;
/// Side in pixels above which a window is searched at half resolution.
const MAX_FULL_RESOLUTION_WINDOW: u32 = 220;
/// Largest distance that a corner may move between the passes, as a fraction of the size of the marker. Corners that
/// move farther belong to something else.
const MAX_CORNER_MOVE: f64 = 0.1;

/// Detects markers in a frame, with corners that do not shrink under blur.
///
/// On gamma-coded pixels a blurred edge moves towards the dark side, and markers appear up to 3 % farther away than
/// they are; on linear pixels shadows make markers hard to detect. So the first pass searches the frame as the camera
/// delivers it, and a second one searches the window around each marker in linear light. If one of the `wanted`
/// numbers is missing at half resolution, the first pass is repeated at full resolution.
pub fn detect_markers(detector: &mut dyn MarkerDetector, frame: &FramePixels, wanted: &[u32]) -> Vec<DetectedMarker> {
    let luma = frame.luma8();
    let Some(image) = LumaView::new(frame.size, &luma) else {
        return Vec::new();
    };
    let mut detected = detector.detect(image, 2.0);
    if wanted.iter().any(|id| detected.iter().all(|marker| marker.id != *id)) {
        let coarse = std::mem::replace(&mut detected, detector.detect(image, 1.0));
        // Large blurred markers may be detected at half resolution only; keep them when another one is missing.
        for marker in coarse {
            if detected.iter().all(|other| other.id != marker.id) {
                detected.push(marker);
            }
        }
    }
    for marker in &mut detected {
        if let Some(corners) = refine_in_linear_light(detector, frame, marker) {
            marker.corners = corners;
        }
    }
    detected
}

fn refine_in_linear_light(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    marker: &DetectedMarker,
) -> Option<[DVec2; 4]> {
    let low = marker.corners.iter().copied().reduce(DVec2::min)?;
    let high = marker.corners.iter().copied().reduce(DVec2::max)?;
    let size = (high - low).max_element();
    let margin = 0.5 * (WINDOW_SIZE - 1.0) * size;
    let start = (low - margin).max(DVec2::ZERO).as_uvec2();
    let end = (high + margin).max(DVec2::ZERO).as_uvec2().min(frame.size);
    let extent = end.checked_sub(start)?;
    let window = linear_window(frame, start, extent);
    let decimation = if extent.max_element() > MAX_FULL_RESOLUTION_WINDOW { 2.0 } else { 1.0 };
    let candidates = detector.detect(LumaView::new(extent, &window)?, decimation);
    let refined = candidates.into_iter().find(|candidate| candidate.id == marker.id)?;
    let corners = refined.corners.map(|corner| corner + start.as_dvec2());
    let is_same = corners.iter().zip(&marker.corners).all(|(a, b)| a.distance(*b) < MAX_CORNER_MOVE * size);
    is_same.then_some(corners)
}

/// Luminance of a window of the frame in linear light, scaled so that its brightest pixel is white.
fn linear_window(frame: &FramePixels, start: UVec2, extent: UVec2) -> Vec<u8> {
    let luminance = |x: u32, y: u32| luminance(frame.linear(x as i32, y as i32));
    let values: Vec<f32> = (0..extent.y)
        .flat_map(|y| (0..extent.x).map(move |x| (x, y)))
        .map(|(x, y)| luminance(start.x + x, start.y + y))
        .collect();
    let scale = 255.0 / values.iter().copied().fold(1e-3, f32::max);
    values.into_iter().map(|value| (value * scale + 0.5) as u8).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Detector that sees one marker at half resolution only, one at full resolution only, and one at both.
    struct Resolutions;

    impl MarkerDetector for Resolutions {
        fn detect(&mut self, _image: LumaView, decimation: f32) -> Vec<DetectedMarker> {
            let at = if decimation == 2.0 { 20.0 } else { 60.0 };
            let corner = |x: f64, y: f64| DVec2::new(at + x, at + y);
            let corners = [corner(0.0, 0.0), corner(9.0, 0.0), corner(9.0, 9.0), corner(0.0, 9.0)];
            let shared = DetectedMarker { id: 2, corners: corners.map(|c| c + 12.0), corrected_bits: 0 };
            vec![DetectedMarker { id: u32::from(decimation == 2.0), corners, corrected_bits: 0 }, shared]
        }
    }

    #[test]
    fn a_missing_marker_does_not_cost_one_seen_at_half_resolution() {
        let frame = FramePixels::new(UVec2::splat(100), vec![128; 40_000]).expect("as many bytes as the size says");
        let ids = |wanted: &[u32]| {
            let mut ids: Vec<_> = detect_markers(&mut Resolutions, &frame, wanted).iter().map(|m| m.id).collect();
            ids.sort_unstable();
            ids
        };
        assert_eq!(ids(&[1, 2]), [1, 2], "all wanted ones are found at half resolution");
        assert_eq!(ids(&[0, 1]), [0, 1, 2], "both searches count, each marker once");
    }
}
