//! Safe interface to the AprilTag C library (Olson 2011, Wang & Olson 2016; version 3.4.5).

use super::{
    DetectedMarker, LumaView, MarkerDetector, MarkerFamily, MarkerId, MarkerPattern, TrackingError,
    apriltag_family::{LoadedFamily, is_by_chance, max_corrected_bits, without_overlaps},
};
use apriltag_sys as sys;
use bevy::math::DVec2;
use std::ptr::NonNull;

/// Shortest side in pixels of the images to search. Shorter ones crash the thresholding of the C library.
const MIN_EDGE: u32 = 16;

/// Detector for AprilTag markers of any of its families.
pub struct AprilTagDetector {
    detector: NonNull<sys::apriltag_detector_t>,
    /// The families that the detector searches for.
    families: Vec<LoadedFamily>,
}

// SAFETY: all pointers are owned, nothing else refers to them, and the library keeps no thread-local state for them.
unsafe impl Send for AprilTagDetector {}
// SAFETY: all access to the library goes through `&mut self`.
unsafe impl Sync for AprilTagDetector {}

impl AprilTagDetector {
    /// Sets the library up with one thread and refined edges, for the family tag36h11.
    ///
    /// # Errors
    /// [`TrackingError::WrongLibrary`] if the linked library is not the version whose memory layout this crate knows;
    /// [`TrackingError::OutOfMemory`] if it could not allocate.
    pub fn new() -> Result<Self, TrackingError> {
        Self::with_families(&[MarkerFamily::Tag36h11])
    }

    /// Sets the library up for some families. Each costs decoding time for each square in an image, and 3 to 150 MB.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_families(families: &[MarkerFamily]) -> Result<Self, TrackingError> {
        // SAFETY: a plain constructor; null is handled.
        let detector = NonNull::new(unsafe { sys::apriltag_detector_create() }).ok_or(TrackingError::OutOfMemory)?;
        let mut this = Self { detector, families: Vec::new() };
        // SAFETY: the detector was just created and is read as the plain struct that it is declared as; values of
        // another layout are still initialized bytes of numbers.
        let fresh = unsafe { detector.as_ref() };
        // A system library of another version has other fields here. These are the documented defaults of 3.4.5.
        let is_known = fresh.nthreads == 1
            && fresh.quad_decimate == 2.0
            && fresh.quad_sigma == 0.0
            && fresh.decode_sharpening == 0.25
            && fresh.nquads == 0;
        if !is_known {
            return Err(TrackingError::WrongLibrary);
        }
        // SAFETY: the detector is exclusively ours, of a known layout. This is the default already, but without it
        // corners are off by 0.6 px instead of 0.07 px.
        unsafe { (*detector.as_ptr()).refine_edges = true };
        this.set_families(families)?;
        Ok(this)
    }

    /// Cells of a printed tag36h11 marker; as [`marker_cells`](super::marker_cells).
    pub fn cells(&self, id: u32) -> Option<Vec<Vec<bool>>> {
        super::marker_cells(id)
    }
}

impl MarkerDetector for AprilTagDetector {
    fn set_families(&mut self, families: &[MarkerFamily]) -> Result<(), TrackingError> {
        self.families.retain(|loaded| {
            let is_kept = families.contains(&loaded.family);
            if !is_kept {
                // SAFETY: the family was added to this detector, which forgets it before it is freed.
                unsafe { sys::apriltag_detector_remove_family(self.detector.as_ptr(), loaded.as_ptr()) };
            }
            is_kept
        });
        for family in families {
            if self.families.iter().any(|loaded| loaded.family == *family) {
                continue;
            }
            let loaded = LoadedFamily::new(*family)?;
            // SAFETY: both exist; the detector only borrows the family, which is freed after it was removed again or
            // after the detector is gone. The library prints and leaves a null pointer if it has no memory.
            let is_ready = unsafe {
                let bits = max_corrected_bits(loaded.family);
                sys::apriltag_detector_add_family_bits(self.detector.as_ptr(), loaded.as_ptr(), bits);
                !(*loaded.as_ptr()).impl_.is_null()
            };
            if !is_ready {
                // SAFETY: as above.
                unsafe { sys::apriltag_detector_remove_family(self.detector.as_ptr(), loaded.as_ptr()) };
                return Err(TrackingError::OutOfMemory);
            }
            self.families.push(loaded);
        }
        Ok(())
    }

    fn pattern(&self, marker: MarkerId) -> Option<MarkerPattern> {
        let loaded = self.families.iter().find(|loaded| loaded.family == marker.family)?;
        Some(MarkerPattern { cells: loaded.cells(marker.id)?, square: marker.family.square_cells() })
    }

    fn detect(&mut self, luma: LumaView, decimation: f32) -> Vec<DetectedMarker> {
        let size = luma.size();
        if size.min_element() < MIN_EDGE || self.families.is_empty() {
            return Vec::new();
        }
        let mut image = sys::image_u8 {
            width: size.x as i32,
            height: size.y as i32,
            stride: size.x as i32,
            // The library takes a mutable pointer and does not write through it.
            buf: luma.pixels().as_ptr().cast_mut(),
        };
        // SAFETY: the image has width · height bytes and outlives the call; the detector is exclusively ours. The list
        // holds pointers to detections, which are copied before everything is freed.
        let detections = unsafe {
            self.detector.as_mut().quad_decimate = decimation;
            let list = sys::apriltag_detector_detect(self.detector.as_ptr(), &raw mut image);
            let Some(detections) = NonNull::new(list) else {
                return Vec::new();
            };
            let pointers = detections.as_ref().data.cast::<*const sys::apriltag_detection_t>();
            let copies: Vec<_> =
                (0..detections.as_ref().size as usize).map(|i| *pointers.add(i).read_unaligned()).collect();
            sys::apriltag_detections_destroy(list);
            copies
        };
        let markers = detections.iter().filter_map(|detection| {
            let loaded = self.families.iter().find(|loaded| std::ptr::eq(loaded.as_ptr(), detection.family))?;
            let marker = from_c(loaded.family, detection);
            (!is_by_chance(&marker, detection.decision_margin)).then_some(marker)
        });
        without_overlaps(markers.collect())
    }
}

/// Converts a detection. The library lists corners as bottom-left, bottom-right, top-right, top-left.
fn from_c(family: MarkerFamily, detection: &sys::apriltag_detection_t) -> DetectedMarker {
    let [bottom_left, bottom_right, top_right, top_left] = detection.p.map(DVec2::from);
    DetectedMarker {
        family,
        id: detection.id.unsigned_abs(),
        corners: [top_left, top_right, bottom_right, bottom_left],
        corrected_bits: detection.hamming.unsigned_abs(),
    }
}

impl Drop for AprilTagDetector {
    fn drop(&mut self) {
        // SAFETY: created in `with_families`, freed once; the families that it refers to are fields and go after it.
        unsafe { sys::apriltag_detector_destroy(self.detector.as_ptr()) };
    }
}
