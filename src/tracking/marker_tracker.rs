//! Markers in the successive frames of one camera.
//!
//! A marker that was in the last frame is aligned with its pattern where it should be now, which costs a fraction of a
//! search. If that fails, the window around it is searched; if a wanted marker is still missing, the whole frame.

use super::{
    DetectedMarker, LumaView, MarkerDetector, MarkerId,
    align_pattern::{Alignment, align_pattern},
};
use crate::camera::FramePixels;
use bevy::{
    ecs::{component::Component, reflect::ReflectComponent},
    reflect::{Reflect, std_traits::ReflectDefault},
};
use glam::{DVec2, UVec2};

/// Number of frames from one search of the whole frame to the next while no wanted marker is missing: for new markers.
const SEARCH_INTERVAL: u32 = 15;
/// Of the searches for a marker that is missing, so many take the full resolution at first, which costs four times as
/// much, and then one of as many.
const FULL_SEARCHES: u32 = 5;
/// Share of the pattern that has to agree with the frame where a marker is only expected, and where one was detected.
const MIN_AGREEMENT: f64 = 0.8;
const MIN_AGREEMENT_DETECTED: f64 = 0.5;
/// Largest distance by which alignment may move a detected corner, as a fraction of the size of the marker.
const MAX_CORNER_MOVE: f64 = 0.1;
/// Margin of the window around a marker, as a fraction of its size, and in pixels.
const WINDOW_MARGIN: f64 = 0.5;
const MIN_WINDOW_MARGIN: f64 = 12.0;
/// Smallest side in pixels to which a marker is reduced when its window is searched.
const MIN_REDUCED_SIDE: f64 = 35.0;
/// Cost of searching a pixel of a window at full resolution, in pixels of a search of the whole frame.
const WINDOW_COST: u32 = 4;

/// Detects markers in the successive frames of one camera: follows those that it knows and searches for the others.
/// The crate has one on each camera that shows a feed.
///
/// ```
/// # use bevy_mirrorball::{camera::FramePixels, tracking::*};
/// # fn track(frames: &[FramePixels]) -> Result<(), TrackingError> {
/// let mut detector = AprilTagDetector::new()?;
/// let mut tracker = MarkerTracker::default();
/// for frame in frames {
///     // A search for marker 0, and then only a look at where it was.
///     let markers = tracker.detect(&mut detector, frame, &[MarkerId::from(0)]);
///     println!("{markers:?}");
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Debug, Clone)]
pub struct MarkerTracker {
    size: UVec2,
    markers: Vec<Followed>,
    /// Frames since the whole frame was searched.
    since_search: u32,
    /// Searches since all wanted markers were there.
    vain_searches: u32,
}

/// A marker of the last frame, and how far its corners had moved since the one before.
#[derive(Reflect, Clone, Debug)]
struct Followed {
    marker: DetectedMarker,
    shift: [DVec2; 4],
}

impl MarkerTracker {
    /// Returns the markers in the next frame, with the corners where their whole pattern fits best in linear light.
    /// Searches the whole frame if one of the `wanted` ones is missing, at full resolution too in the first five frames
    /// and then in one of five. Without wanted markers, and for new ones beside them, one of fifteen frames is
    /// searched.
    pub fn detect(
        &mut self,
        detector: &mut dyn MarkerDetector,
        frame: &FramePixels,
        wanted: &[MarkerId],
    ) -> Vec<DetectedMarker> {
        if frame.size != self.size {
            *self = Self { size: frame.size, ..Self::default() };
        }
        let mut found = Vec::new();
        for followed in &self.markers {
            if let Some(marker) = followed.find(detector, frame, wanted)
                && !is_among(&marker, &found)
            {
                found.push(marker);
            }
        }
        self.since_search += 1;
        let is_missing = |followed: &[DetectedMarker], searched: &[DetectedMarker]| {
            let all = followed.iter().chain(searched).map(DetectedMarker::marker);
            wanted.iter().any(|wanted| all.clone().all(|marker| marker != *wanted))
        };
        if found.is_empty() || is_missing(&found, &[]) || self.since_search >= SEARCH_INTERVAL {
            self.since_search = 0;
            let luma = frame.luma8();
            let mut searched: Vec<DetectedMarker> = Vec::new();
            let mut search = |decimation| {
                let markers = LumaView::new(frame.size, &luma).map(|luma| detector.detect(luma, decimation));
                for marker in markers.into_iter().flatten() {
                    if !is_among(&marker, &found) && !is_among(&marker, &searched) {
                        searched.push(aligned(detector, frame, marker));
                    }
                }
                is_missing(&found, &searched)
            };
            if !search(2.0) {
                self.vain_searches = 0;
            } else {
                // Large blurred markers may be detected at half resolution only, so both searches count.
                let is_full = self.vain_searches < FULL_SEARCHES || self.vain_searches.is_multiple_of(FULL_SEARCHES);
                self.vain_searches = if is_full && !search(1.0) { 0 } else { self.vain_searches + 1 };
            }
            // What was followed is covered by another marker.
            found.retain(|followed| searched.iter().all(|marker| !is_at_place_of(marker, followed)));
            found.append(&mut searched);
        }
        self.remember(&found);
        found
    }

    /// The markers that are worth a search of the whole frame if they are missing: those of each group that are
    /// followed, or all of a group of which none is. Of a box, some sides are always out of view.
    pub(super) fn worth_a_search(&self, groups: &[Vec<MarkerId>]) -> Vec<MarkerId> {
        let is_followed = |marker: &MarkerId| self.markers.iter().any(|followed| followed.marker.marker() == *marker);
        let of_group = |group: &Vec<MarkerId>| {
            let followed: Vec<MarkerId> = group.iter().copied().filter(is_followed).collect();
            if followed.is_empty() { group.clone() } else { followed }
        };
        groups.iter().flat_map(of_group).collect()
    }

    fn remember(&mut self, found: &[DetectedMarker]) {
        let last = std::mem::take(&mut self.markers);
        self.markers = found
            .iter()
            .map(|marker| {
                let same = last.iter().filter(|last| last.marker.marker() == marker.marker());
                let before = same.min_by(|a, b| {
                    let distance = |last: &Followed| center(&last.marker.corners).distance(center(&marker.corners));
                    distance(a).total_cmp(&distance(b))
                });
                let shift = |before: &Followed| std::array::from_fn(|i| marker.corners[i] - before.marker.corners[i]);
                Followed { marker: marker.clone(), shift: before.map(shift).unwrap_or_default() }
            })
            .collect();
    }
}

impl Followed {
    /// Finds the marker in the next frame. One that is not wanted is not searched for.
    fn find(
        &self,
        detector: &mut dyn MarkerDetector,
        frame: &FramePixels,
        wanted: &[MarkerId],
    ) -> Option<DetectedMarker> {
        let expected: [DVec2; 4] = std::array::from_fn(|i| self.marker.corners[i] + self.shift[i]);
        let pattern = detector.pattern(self.marker.marker());
        if let Some(pattern) = &pattern {
            for start in [&expected, &self.marker.corners] {
                let aligned = align_pattern(frame, start, pattern);
                if let Some(Alignment { corners, .. }) = aligned.filter(|fit| fit.agreement >= MIN_AGREEMENT) {
                    return Some(DetectedMarker { corners, corrected_bits: 0, ..self.marker.clone() });
                }
            }
        }
        let is_wanted = wanted.contains(&self.marker.marker());
        let marker = self.search_window(detector, frame, &expected, is_wanted)?;
        Some(aligned(detector, frame, marker))
    }

    /// Searches the window around the marker, which covers where it was and where it is expected.
    fn search_window(
        &self,
        detector: &mut dyn MarkerDetector,
        frame: &FramePixels,
        expected: &[DVec2; 4],
        is_wanted: bool,
    ) -> Option<DetectedMarker> {
        let all = expected.iter().chain(&self.marker.corners).copied();
        let (low, high) = (all.clone().reduce(DVec2::min)?, all.reduce(DVec2::max)?);
        let family = self.marker.family;
        let around = 0.5 * (f64::from(family.print_cells()) / f64::from(family.square_cells()) - 1.0);
        let side = (0..4).map(|i| expected[i].distance(expected[(i + 1) % 4])).sum::<f64>() / 4.0;
        let margin = MIN_WINDOW_MARGIN.max((WINDOW_MARGIN + around) * side);
        let start = (low - margin).max(DVec2::ZERO).as_uvec2();
        let extent = (high + margin).max(DVec2::ZERO).as_uvec2().min(frame.size).checked_sub(start)?;
        let luma = frame.luma8_window(start, extent);
        let reduced = (side / MIN_REDUCED_SIDE).floor().clamp(1.0, 4.0) as f32;
        let center_expected = center(expected);
        // A detector that does not look at its image is left to searches of the whole frame.
        let is_inside =
            |corner: &DVec2| corner.min_element() >= 0.0 && (extent.as_dvec2() - *corner).min_element() >= 0.0;
        let mut search = |decimation| {
            let candidates = detector.detect(LumaView::new(extent, &luma)?, decimation).into_iter();
            candidates
                .filter(|candidate| candidate.marker() == self.marker.marker())
                .filter(|candidate| candidate.corners.iter().all(is_inside))
                .map(|candidate| DetectedMarker {
                    corners: candidate.corners.map(|corner| corner + start.as_dvec2()),
                    ..candidate
                })
                .min_by(|a, b| {
                    let distance = |marker: &DetectedMarker| center(&marker.corners).distance(center_expected);
                    distance(a).total_cmp(&distance(b))
                })
        };
        let is_full_cheaper = WINDOW_COST * extent.element_product() < frame.size.element_product();
        search(reduced).or_else(|| (reduced > 1.0 && is_wanted && is_full_cheaper).then(|| search(1.0))?)
    }
}

/// A detected marker with its corners where its pattern fits the frame, or as detected if it does not fit.
fn aligned(detector: &dyn MarkerDetector, frame: &FramePixels, marker: DetectedMarker) -> DetectedMarker {
    let size = (0..4).map(|i| marker.corners[i].distance(marker.corners[(i + 2) % 4])).fold(0.0, f64::max);
    let alignment = detector.pattern(marker.marker()).and_then(|of| align_pattern(frame, &marker.corners, &of));
    let is_same = |corners: &[DVec2; 4]| {
        corners.iter().zip(&marker.corners).all(|(a, b)| a.distance(*b) < MAX_CORNER_MOVE * size)
    };
    let corners = alignment.filter(|fit| fit.agreement >= MIN_AGREEMENT_DETECTED).map(|fit| fit.corners);
    DetectedMarker { corners: corners.filter(is_same).unwrap_or(marker.corners), ..marker }
}

/// Whether a marker was found already: of the same number, and at the same place.
fn is_among(marker: &DetectedMarker, found: &[DetectedMarker]) -> bool {
    found.iter().any(|other| other.marker() == marker.marker() && is_at_place_of(marker, other))
}

/// Whether two markers have their centers within each other.
fn is_at_place_of(marker: &DetectedMarker, other: &DetectedMarker) -> bool {
    let size = marker.corners[0].distance(marker.corners[2]).min(other.corners[0].distance(other.corners[2]));
    center(&other.corners).distance(center(&marker.corners)) < 0.3 * size
}

fn center(corners: &[DVec2; 4]) -> DVec2 {
    corners.iter().sum::<DVec2>() / 4.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracking::MarkerFamily;

    const SIZE: UVec2 = UVec2::new(160, 120);

    /// Detector that sees marker 1 in the middle of all images, and counts searches of whole frames.
    #[derive(Default)]
    struct Middle {
        searches: u32,
    }

    impl MarkerDetector for Middle {
        fn detect(&mut self, image: LumaView, _decimation: f32) -> Vec<DetectedMarker> {
            self.searches += u32::from(image.size() == SIZE);
            let middle = 0.5 * image.size().as_dvec2();
            let corners =
                [(-9.0, -9.0), (9.0, -9.0), (9.0, 9.0), (-9.0, 9.0)].map(|corner| middle + DVec2::from(corner));
            vec![DetectedMarker { family: MarkerFamily::Tag36h11, id: 1, corners, corrected_bits: 0 }]
        }
    }

    /// Searches of whole frames while a number of frames is tracked.
    fn searches(groups: &[&[u32]], frames: u32) -> u32 {
        let frame = FramePixels::new(SIZE, vec![128; 4 * 160 * 120]).expect("as many bytes as the size says");
        let groups: Vec<Vec<MarkerId>> =
            groups.iter().map(|group| group.iter().map(|id| (*id).into()).collect()).collect();
        let (mut detector, mut tracker) = (Middle::default(), MarkerTracker::default());
        for _ in 0..frames {
            let wanted = tracker.worth_a_search(&groups);
            assert_eq!(tracker.detect(&mut detector, &frame, &wanted).len(), 1);
        }
        detector.searches
    }

    #[test]
    fn a_marker_that_is_followed_costs_a_search_in_one_of_fifteen_frames() {
        assert_eq!(searches(&[&[1]], 15), 1);
        assert_eq!(searches(&[&[1]], 31), 3);
    }

    #[test]
    fn a_missing_marker_is_searched_in_every_frame_but_not_the_hidden_sides_of_a_box() {
        // At half resolution, and in six of ten frames at full resolution too.
        assert_eq!(searches(&[&[1], &[2]], 10), 16);
        assert_eq!(searches(&[&[1, 2, 3]], 10), 2);
    }
}
