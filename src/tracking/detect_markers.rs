//! Marker detection in a frame, with corners refined in linear light.

use super::{DetectedMarker, LumaView, MarkerDetector, MarkerFamily, MarkerId};
use crate::{camera::FramePixels, luminance::luminance};
use glam::{DVec2, UVec2};

/// Side of the window around a marker, as a multiple of the size of the marker.
const WINDOW_SIZE: f64 = 2.3;
/// Side of the window as a multiple of the width of the whole print, for families with much around their square.
const MIN_WINDOW_PRINTS: f64 = 1.3;
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
/// markers is missing at half resolution, the first pass is repeated at full resolution.
pub fn detect_markers(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    wanted: &[MarkerId],
) -> Vec<DetectedMarker> {
    let luma = frame.luma8();
    let Some(image) = LumaView::new(frame.size, &luma) else {
        return Vec::new();
    };
    let mut detected = detector.detect(image, 2.0);
    if wanted.iter().any(|wanted| detected.iter().all(|marker| marker.marker() != *wanted)) {
        let coarse = std::mem::replace(&mut detected, detector.detect(image, 1.0));
        // Large blurred markers may be detected at half resolution only; keep them when another one is missing.
        for marker in coarse {
            if detected.iter().all(|other| other.marker() != marker.marker()) {
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

/// Returns which of the `wanted` markers are in the mirror image of a frame.
pub(super) fn detect_mirrored(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    wanted: &[MarkerId],
) -> Vec<MarkerId> {
    let mut luma = frame.luma8();
    luma.chunks_exact_mut(frame.size.x as usize).for_each(<[u8]>::reverse);
    let Some(image) = LumaView::new(frame.size, &luma) else {
        return Vec::new();
    };
    let mut seen = Vec::new();
    for decimation in [2.0, 1.0] {
        if seen.is_empty() {
            seen = detector.detect(image, decimation).iter().map(DetectedMarker::marker).collect();
            seen.retain(|marker| wanted.contains(marker));
        }
    }
    seen.sort_unstable();
    seen.dedup();
    seen
}

fn refine_in_linear_light(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    marker: &DetectedMarker,
) -> Option<[DVec2; 4]> {
    let low = marker.corners.iter().copied().reduce(DVec2::min)?;
    let high = marker.corners.iter().copied().reduce(DVec2::max)?;
    let size = (high - low).max_element();
    let margin = 0.5 * (window_size(marker.family) - 1.0) * size;
    let start = (low - margin).max(DVec2::ZERO).as_uvec2();
    let end = (high + margin).max(DVec2::ZERO).as_uvec2().min(frame.size);
    let extent = end.checked_sub(start)?;
    let window = linear_window(frame, start, extent);
    let decimation = if extent.max_element() > MAX_FULL_RESOLUTION_WINDOW { 2.0 } else { 1.0 };
    let candidates = detector.detect(LumaView::new(extent, &window)?, decimation);
    // Another sheet with the same number may be in the window too.
    let is_same = |corners: &[DVec2; 4]| {
        corners.iter().zip(&marker.corners).all(|(a, b)| a.distance(*b) < MAX_CORNER_MOVE * size)
    };
    candidates
        .into_iter()
        .filter(|candidate| candidate.marker() == marker.marker())
        .map(|candidate| candidate.corners.map(|corner| corner + start.as_dvec2()))
        .find(is_same)
}

/// Side of the window around a marker, as a multiple of its size.
fn window_size(family: MarkerFamily) -> f64 {
    let print = f64::from(family.print_cells()) / f64::from(family.square_cells());
    WINDOW_SIZE.max(MIN_WINDOW_PRINTS * print)
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

    /// Detector of two sheets with one number, of which the second is seen first in windows, and of one that is seen in
    /// mirrored frames only.
    struct Twins;

    impl MarkerDetector for Twins {
        fn detect(&mut self, image: LumaView, _decimation: f32) -> Vec<DetectedMarker> {
            let square = |x: f64, size: f64, id: u32| {
                let corners =
                    [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)].map(|(u, v)| DVec2::new(x + u, 20.0 + v));
                DetectedMarker { family: MarkerFamily::Tag36h11, id, corners, corrected_bits: 0 }
            };
            if image.size().x != 100 {
                // The window around the first one begins 6.5 pixels beside it.
                let near = |x: f64| DetectedMarker {
                    corners: square(x, 10.1, 3).corners.map(|c| c - DVec2::Y * 13.5),
                    ..square(x, 1.0, 3)
                };
                return vec![near(15.5), near(6.5)];
            }
            if image.pixels()[0] == 0 {
                return vec![square(10.0, 10.0, 3), square(60.0, 10.0, 3)];
            }
            vec![square(10.0, 10.0, 7)]
        }
    }

    #[test]
    fn sheets_with_one_number_are_refined_each_by_itself() {
        let frame = FramePixels::new(UVec2::splat(100), vec![0; 40_000]).expect("as many bytes as the size says");
        let found = detect_markers(&mut Twins, &frame, &[3.into()]);
        assert_eq!(found.len(), 2);
        assert!((found[0].corners[1].x - 19.6).abs() < 1.0, "{:?}", found[0]);
        assert!((found[1].corners[0].x - 60.0).abs() < 1.0, "{:?}", found[1]);
    }

    #[test]
    fn a_wanted_number_is_found_in_the_mirror_image() {
        let mut rgba = vec![0; 40_000];
        rgba[396..399].fill(255);
        let frame = FramePixels::new(UVec2::splat(100), rgba).expect("as many bytes as the size says");
        assert_eq!(detect_mirrored(&mut Twins, &frame, &[3.into(), 7.into()]), [7.into()]);
        assert!(detect_mirrored(&mut Twins, &frame, &[3.into()]).is_empty());
    }

    /// Detector that sees one marker at half resolution only, one at full resolution only, and one at both.
    struct Resolutions;

    impl MarkerDetector for Resolutions {
        fn detect(&mut self, _image: LumaView, decimation: f32) -> Vec<DetectedMarker> {
            let at = if decimation == 2.0 { 20.0 } else { 60.0 };
            let corner = |x: f64, y: f64| DVec2::new(at + x, at + y);
            let corners = [corner(0.0, 0.0), corner(9.0, 0.0), corner(9.0, 9.0), corner(0.0, 9.0)];
            let marker =
                |id, corners| DetectedMarker { family: MarkerFamily::Tag36h11, id, corners, corrected_bits: 0 };
            vec![marker(u32::from(decimation == 2.0), corners), marker(2, corners.map(|c| c + 12.0))]
        }
    }

    #[test]
    fn a_missing_marker_does_not_cost_one_seen_at_half_resolution() {
        let frame = FramePixels::new(UVec2::splat(100), vec![128; 40_000]).expect("as many bytes as the size says");
        let ids = |wanted: &[u32]| {
            let wanted: Vec<MarkerId> = wanted.iter().copied().map(MarkerId::from).collect();
            let mut ids: Vec<_> = detect_markers(&mut Resolutions, &frame, &wanted).iter().map(|m| m.id).collect();
            ids.sort_unstable();
            ids
        };
        assert_eq!(ids(&[1, 2]), [1, 2], "all wanted ones are found at half resolution");
        assert_eq!(ids(&[0, 1]), [0, 1, 2], "both searches count, each marker once");
    }
}
