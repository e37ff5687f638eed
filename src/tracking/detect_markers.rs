//! Marker detection in a single frame.

use super::{DetectedMarker, LumaView, MarkerDetector, MarkerId, MarkerTracker};
use crate::camera::FramePixels;

/// Detects markers in a frame without a past, with corners that do not shrink under blur.
///
/// The frame is searched at half resolution, and once more at full resolution if one of the `wanted` markers is
/// missing. Each marker's pattern is then aligned with the frame in linear light: on gamma-coded pixels a blurred edge
/// moves towards the dark side, and markers appear up to 3 % farther away than they are. For frame after frame use a
/// [`MarkerTracker`].
pub fn detect_markers(
    detector: &mut dyn MarkerDetector,
    frame: &FramePixels,
    wanted: &[MarkerId],
) -> Vec<DetectedMarker> {
    MarkerTracker::default().detect(detector, frame, wanted)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::MarkerFamily;
    use glam::{DVec2, UVec2};

    fn marker(id: u32, x: f64) -> DetectedMarker {
        let corners = [(0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 9.0)].map(|(u, v)| DVec2::new(x + u, 20.0 + v));
        DetectedMarker { family: MarkerFamily::Tag36h11, id, corners, corrected_bits: 0 }
    }

    /// Detector of a marker that is seen in mirrored frames only.
    struct Mirrored;

    impl MarkerDetector for Mirrored {
        fn detect(&mut self, image: LumaView, _decimation: f32) -> Vec<DetectedMarker> {
            if image.pixels()[0] == 0 { Vec::new() } else { vec![marker(7, 10.0)] }
        }
    }

    #[test]
    fn a_wanted_number_is_found_in_the_mirror_image() {
        let mut rgba = vec![0; 40_000];
        rgba[396..399].fill(255);
        let frame = FramePixels::new(UVec2::splat(100), rgba).expect("as many bytes as the size says");
        assert_eq!(detect_mirrored(&mut Mirrored, &frame, &[3.into(), 7.into()]), [7.into()]);
        assert!(detect_mirrored(&mut Mirrored, &frame, &[3.into()]).is_empty());
    }

    /// Detector that sees one marker at half resolution only, one at full resolution only, and one at both.
    struct Resolutions;

    impl MarkerDetector for Resolutions {
        fn detect(&mut self, _image: LumaView, decimation: f32) -> Vec<DetectedMarker> {
            let (id, x) = if decimation == 2.0 { (1, 20.0) } else { (0, 60.0) };
            vec![marker(id, x), marker(2, 40.0)]
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
