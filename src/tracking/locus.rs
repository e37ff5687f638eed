//! Markers by the crate `locus-core` (N. Fontana 2026), in pure Rust: for browsers, and without a C compiler.

use super::{DetectedMarker, LumaView, MarkerDetector, MarkerFamily, MarkerId, MarkerPattern, TrackingError, tag36h11};
use bevy::math::DVec2;
use locus_core::{Detector, DetectorBuilder, ImageView, TagFamily};
use std::{
    fmt,
    sync::{Mutex, PoisonError},
};

/// Shortest side in pixels of the images to search. The library panics on images of single pixels.
const MIN_EDGE: u32 = 16;
/// Decimation from which an image is searched at half its resolution.
const HALF: f32 = 1.5;

/// Detector for AprilTag markers of the family tag36h11 in pure Rust.
///
/// Not as good at photographs as [the C library](super::AprilTagDetector) (it reads 84 of the 93 markers that the
/// library reads in 55 photographs), nor as exact at small markers (its corners are off by 0.6 to 1 pixel in rendered
/// markers 24 pixels wide, those of the library by 0.2), twice as fast, and without the other families. Corners are
/// aligned with the printed pattern afterwards, as they are with that: poses on the recorded desk are equal.
pub struct LocusDetector {
    /// At full resolution. Detectors may not be shared between threads, which a mutex makes up for.
    full: Mutex<Detector>,
    /// At half the resolution.
    half: Mutex<Detector>,
}

impl LocusDetector {
    /// Sets the detector up, with one thread.
    pub fn new() -> Self {
        // Browsers have no threads to make: 0 stands for what there is.
        let threads = if cfg!(target_arch = "wasm32") { 0 } else { 1 };
        let detector = |decimation| {
            let builder = DetectorBuilder::new().with_family(TagFamily::AprilTag36h11);
            Mutex::new(builder.with_decimation(decimation).with_threads(threads).build())
        };
        Self { full: detector(1), half: detector(2) }
    }
}

impl Default for LocusDetector {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Debug for LocusDetector {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("LocusDetector").finish_non_exhaustive()
    }
}

impl MarkerDetector for LocusDetector {
    fn set_families(&mut self, families: &[MarkerFamily]) -> Result<(), TrackingError> {
        match families.iter().find(|family| **family != MarkerFamily::Tag36h11) {
            None => Ok(()),
            Some(family) => Err(TrackingError::UnknownToDetector(*family)),
        }
    }

    fn pattern(&self, marker: MarkerId) -> Option<MarkerPattern> {
        let family = MarkerFamily::Tag36h11;
        (marker.family == family)
            .then(|| Some(MarkerPattern { cells: tag36h11::cells(marker.id)?, square: family.square_cells() }))?
    }

    fn detect(&mut self, image: LumaView, decimation: f32) -> Vec<DetectedMarker> {
        let size = image.size();
        if size.min_element() < MIN_EDGE {
            return Vec::new();
        }
        let detector = if decimation < HALF { &mut self.full } else { &mut self.half };
        let detector = detector.get_mut().unwrap_or_else(PoisonError::into_inner);
        let view = ImageView::new(image.pixels(), size.x as usize, size.y as usize, size.x as usize);
        let found = view.ok().and_then(|view| Some(detector.detect(&view, None, None, false).ok()?.reassemble_owned()));
        let marker = |found: locus_core::Detection| {
            // The library has the family as OpenCV's dictionary has it, turned by 180°.
            let [a, b, c, d] = found.corners.map(DVec2::from);
            let corners = [c, d, a, b];
            DetectedMarker { family: MarkerFamily::Tag36h11, id: found.id, corners, corrected_bits: found.hamming }
        };
        found.into_iter().flatten().map(marker).collect()
    }
}
