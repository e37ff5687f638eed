//! Safe interface to the AprilTag C library (Olson 2011, Wang & Olson 2016; version 3.4.5).

use super::{DetectedMarker, LumaView, MarkerDetector, TrackingError};
use apriltag_sys as sys;
use bevy::math::DVec2;
use std::ptr::NonNull;

/// Shortest side in pixels of the images to search. Shorter ones crash the thresholding of the C library.
const MIN_EDGE: u32 = 16;
/// Number of bits that the decoder corrects at most. More would make false detections likely.
const MAX_CORRECTED_BITS: i32 = 2;

/// Detector for the family tag36h11.
pub struct AprilTagDetector {
    family: NonNull<sys::apriltag_family_t>,
    detector: NonNull<sys::apriltag_detector_t>,
}

// SAFETY: both pointers are owned, nothing else refers to them, and the library keeps no thread-local state for them.
unsafe impl Send for AprilTagDetector {}
// SAFETY: all access to the library goes through `&mut self`.
unsafe impl Sync for AprilTagDetector {}

impl AprilTagDetector {
    /// Sets the library up with one thread, refined edges and two corrected bits.
    ///
    /// # Errors
    /// [`TrackingError::WrongLibrary`] if the linked library is not the version whose memory layout this crate knows;
    /// [`TrackingError::OutOfMemory`] if it could not allocate.
    pub fn new() -> Result<Self, TrackingError> {
        // SAFETY: plain constructors; null is handled.
        let (family, detector) =
            unsafe { (NonNull::new(sys::tag36h11_create()), NonNull::new(sys::apriltag_detector_create())) };
        let (Some(family), Some(detector)) = (family, detector) else {
            return Err(TrackingError::OutOfMemory);
        };
        let this = Self { family, detector };
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
        // SAFETY: both were created above; the detector only borrows the family, which `drop` frees after it.
        unsafe { sys::apriltag_detector_add_family_bits(detector.as_ptr(), family.as_ptr(), MAX_CORRECTED_BITS) };
        Ok(this)
    }

    /// Cells of a printed marker, 10 × 10 with its white margin, rows from top to bottom; `true` is white. Returns
    /// `None` if the family has no such number.
    pub fn cells(&self, id: u32) -> Option<Vec<Vec<bool>>> {
        // SAFETY: the family lives as long as `self`.
        if id >= unsafe { self.family.as_ref() }.ncodes {
            return None;
        }
        // SAFETY: the id is in range; the image is ours to free.
        let image = NonNull::new(unsafe { sys::apriltag_to_image(self.family.as_ptr(), id) })?;
        // SAFETY: the library created a width × height image with this stride.
        let cells = unsafe {
            let image = image.as_ref();
            let row = |y: i32| {
                (0..image.width).map(|x| *image.buf.offset((y * image.stride + x) as isize) > 127).collect::<Vec<_>>()
            };
            (0..image.height).map(row).collect()
        };
        // SAFETY: created by the library, not used afterwards.
        unsafe { sys::image_u8_destroy(image.as_ptr()) };
        Some(cells)
    }
}

impl MarkerDetector for AprilTagDetector {
    fn detect(&mut self, luma: LumaView, decimation: f32) -> Vec<DetectedMarker> {
        let size = luma.size();
        if size.min_element() < MIN_EDGE {
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
        unsafe {
            self.detector.as_mut().quad_decimate = decimation;
            let list = sys::apriltag_detector_detect(self.detector.as_ptr(), &raw mut image);
            let Some(detections) = NonNull::new(list) else {
                return Vec::new();
            };
            let pointers = detections.as_ref().data.cast::<*const sys::apriltag_detection_t>();
            let markers =
                (0..detections.as_ref().size as usize).map(|i| from_c(&*pointers.add(i).read_unaligned())).collect();
            sys::apriltag_detections_destroy(list);
            markers
        }
    }
}

/// Converts a detection. The library lists corners as bottom-left, bottom-right, top-right, top-left.
fn from_c(detection: &sys::apriltag_detection_t) -> DetectedMarker {
    let [bottom_left, bottom_right, top_right, top_left] = detection.p.map(DVec2::from);
    DetectedMarker {
        id: detection.id.unsigned_abs(),
        corners: [top_left, top_right, bottom_right, bottom_left],
        corrected_bits: detection.hamming.unsigned_abs(),
    }
}

impl Drop for AprilTagDetector {
    fn drop(&mut self) {
        // SAFETY: created in `new`, freed once; the detector goes before the family it refers to.
        unsafe {
            sys::apriltag_detector_destroy(self.detector.as_ptr());
            sys::tag36h11_destroy(self.family.as_ptr());
        }
    }
}
