//! Marker families of the AprilTag C library, and how likely each is found by chance.

use super::{DetectedMarker, MarkerFamily, MarkerId, TrackingError};
use apriltag_sys as sys;
use bevy::math::DVec2;
use std::{cmp::Ordering, ptr::NonNull};

/// Smallest mean contrast of cells (0…255, half of the distance between black and white) at which a marker of a family
/// with few bits is believed. Dim rendered ones have 85 and more, those invented in photographs about 1.
const MIN_CONTRAST_OF_FEW_BITS: f32 = 40.0;
/// Largest distance between the centers of two detections of one square, as a fraction of its size.
const MAX_CENTER_DISTANCE: f64 = 0.25;

// The library has this family, the bindings forgot it.
unsafe extern "C" {
    fn tag36h10_create() -> *mut sys::apriltag_family_t;
    fn tag36h10_destroy(family: *mut sys::apriltag_family_t);
}

/// A family in the form of the library; freed when dropped. Detectors that were given it must have forgotten it by
/// then.
pub(super) struct LoadedFamily {
    pub(super) family: MarkerFamily,
    tag: NonNull<sys::apriltag_family_t>,
}

impl LoadedFamily {
    /// Loads a family.
    ///
    /// # Errors
    /// [`TrackingError::OutOfMemory`].
    pub(super) fn new(family: MarkerFamily) -> Result<Self, TrackingError> {
        // SAFETY: plain constructors; null is handled.
        let tag = unsafe {
            match family {
                MarkerFamily::Tag36h11 => sys::tag36h11_create(),
                MarkerFamily::Tag25h9 => sys::tag25h9_create(),
                MarkerFamily::Tag16h5 => sys::tag16h5_create(),
                MarkerFamily::Tag36h10 => tag36h10_create(),
                MarkerFamily::TagCircle21h7 => sys::tagCircle21h7_create(),
                MarkerFamily::TagCircle49h12 => sys::tagCircle49h12_create(),
                MarkerFamily::TagCustom48h12 => sys::tagCustom48h12_create(),
                MarkerFamily::TagStandard41h12 => sys::tagStandard41h12_create(),
                MarkerFamily::TagStandard52h13 => sys::tagStandard52h13_create(),
            }
        };
        let tag = NonNull::new(tag).ok_or(TrackingError::OutOfMemory)?;
        Ok(Self { family, tag })
    }

    pub(super) fn as_ptr(&self) -> *mut sys::apriltag_family_t {
        self.tag.as_ptr()
    }

    /// As [`marker_cells`].
    pub(super) fn cells(&self, id: u32) -> Option<Vec<Vec<bool>>> {
        MarkerId::new(self.family, id).check().ok()?;
        let family = self.family;
        let (print, square) = (family.print_cells() as i32, family.square_cells() as i32);
        let mut cells = vec![vec![true; print as usize]; print as usize];
        // The ring of black cells: the outermost of the square, or the one around it.
        let (low, high) = match (print - square) / 2 {
            margin if family.has_border_inside() => (margin - 1, margin + square),
            margin => (margin, margin + square - 1),
        };
        for i in low..=high {
            for (x, y) in [(i, low), (i, high), (low, i), (high, i)] {
                cells[y as usize][x as usize] = false;
            }
        }
        // SAFETY: the family lives until the end of this function; it has `ncodes` codes and `nbits` positions of
        // cells, which lie in the print. The number is in range.
        unsafe {
            let tag = self.tag.as_ref();
            let code = *tag.codes.add(id as usize);
            for i in 0..tag.nbits {
                let (x, y) = (*tag.bit_x.add(i as usize) as i32, *tag.bit_y.add(i as usize) as i32);
                let margin = (print - square) / 2;
                let is_white = code >> (tag.nbits - 1 - i) & 1 == 1;
                cells[(y + margin) as usize][(x + margin) as usize] = is_white;
            }
        }
        Some(cells)
    }
}

impl Drop for LoadedFamily {
    fn drop(&mut self) {
        let tag = self.tag.as_ptr();
        // SAFETY: created by the constructor of the same family, freed once.
        unsafe {
            match self.family {
                MarkerFamily::Tag36h11 => sys::tag36h11_destroy(tag),
                MarkerFamily::Tag25h9 => sys::tag25h9_destroy(tag),
                MarkerFamily::Tag16h5 => sys::tag16h5_destroy(tag),
                MarkerFamily::Tag36h10 => tag36h10_destroy(tag),
                MarkerFamily::TagCircle21h7 => sys::tagCircle21h7_destroy(tag),
                MarkerFamily::TagCircle49h12 => sys::tagCircle49h12_destroy(tag),
                MarkerFamily::TagCustom48h12 => sys::tagCustom48h12_destroy(tag),
                MarkerFamily::TagStandard41h12 => sys::tagStandard41h12_destroy(tag),
                MarkerFamily::TagStandard52h13 => sys::tagStandard52h13_destroy(tag),
            }
        }
    }
}

/// Number of bits that the decoder corrects at most. Each makes false detections some ten times as likely, and the
/// tables of large families fifty times as large.
pub(super) fn max_corrected_bits(family: MarkerFamily) -> i32 {
    match family {
        MarkerFamily::Tag36h11 => 2,
        MarkerFamily::Tag16h5 | MarkerFamily::TagCircle21h7 => 0,
        _ => 1,
    }
}

/// Number of data cells of a family's markers.
fn bits(family: MarkerFamily) -> u32 {
    match family {
        MarkerFamily::Tag16h5 => 16,
        MarkerFamily::TagCircle21h7 => 21,
        MarkerFamily::Tag25h9 => 25,
        MarkerFamily::Tag36h11 | MarkerFamily::Tag36h10 => 36,
        MarkerFamily::TagStandard41h12 => 41,
        MarkerFamily::TagCustom48h12 => 48,
        MarkerFamily::TagCircle49h12 => 49,
        MarkerFamily::TagStandard52h13 => 52,
    }
}

/// Probability that random bits are read as any marker of a family, with at most that many corrected bits.
fn chance(family: MarkerFamily, corrected_bits: u32) -> f64 {
    let bits = bits(family);
    let mut choices = 1.0;
    let mut words = 0.0;
    for corrected in 0..=corrected_bits.min(bits) {
        words += choices;
        choices *= f64::from(bits - corrected.min(bits)) / f64::from(corrected + 1);
    }
    // A marker is read in any of four directions.
    4.0 * f64::from(family.marker_count()) * words / f64::from(bits).exp2()
}

/// Returns whether a detection is of a family with so few bits, and of so little contrast, that it is nothing.
pub(super) fn is_by_chance(marker: &DetectedMarker, contrast: f32) -> bool {
    const MAX_CHANCE: f64 = 1e-3;
    chance(marker.family, marker.corrected_bits) > MAX_CHANCE && contrast < MIN_CONTRAST_OF_FEW_BITS
}

/// Of the markers of different families that were read from one square, keeps the one that is the least likely by
/// chance.
pub(super) fn without_overlaps(mut markers: Vec<DetectedMarker>) -> Vec<DetectedMarker> {
    let chance = |marker: &DetectedMarker| chance(marker.family, marker.corrected_bits);
    markers.sort_by(|a, b| chance(a).partial_cmp(&chance(b)).unwrap_or(Ordering::Equal));
    let mut kept: Vec<DetectedMarker> = Vec::with_capacity(markers.len());
    for marker in markers {
        let center = |marker: &DetectedMarker| marker.corners.iter().sum::<DVec2>() / 4.0;
        let is_same = |other: &DetectedMarker| {
            let size = other.corners[0].distance(other.corners[2]).max(marker.corners[0].distance(marker.corners[2]));
            center(other).distance(center(&marker)) < MAX_CENTER_DISTANCE * size
        };
        // A small marker may be printed into the middle of a custom one.
        if kept.iter().all(|other| other.family == marker.family || !is_same(other)) {
            kept.push(marker);
        }
    }
    kept
}

/// Cells of a printed marker, [`MarkerFamily::print_cells`] along a side, rows from top to bottom; `true` is white.
/// Cells that a family leaves unused are white. Returns `None` if the family has no such number.
///
/// ```
/// # use bevy_mirrorball::tracking::{MarkerFamily, MarkerId, marker_cells};
/// for row in marker_cells(MarkerId::new(MarkerFamily::Tag16h5, 3)).expect("there are 30") {
///     println!("{}", row.into_iter().map(|is_white| if is_white { "  " } else { "██" }).collect::<String>());
/// }
/// ```
pub fn marker_cells(marker: impl Into<MarkerId>) -> Option<Vec<Vec<bool>>> {
    let marker = marker.into();
    LoadedFamily::new(marker.family).ok()?.cells(marker.id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_has_the_families_as_described_here() {
        for family in MarkerFamily::ALL {
            let loaded = LoadedFamily::new(family).expect("memory");
            // SAFETY: the family lives as long as `loaded`; its name is a text that ends with a zero.
            let (tag, name) = unsafe { (loaded.tag.as_ref(), std::ffi::CStr::from_ptr(loaded.tag.as_ref().name)) };
            assert_eq!(name.to_str(), Ok(family.name()));
            assert_eq!((tag.ncodes, tag.nbits), (family.marker_count(), bits(family)), "{family}");
            let cells = (tag.width_at_border as u32, tag.total_width as u32, tag.reversed_border);
            assert_eq!(cells, (family.square_cells(), family.print_cells(), family.has_border_inside()), "{family}");
        }
    }

    #[test]
    fn the_border_of_every_family_is_drawn_with_its_white_ring() {
        for family in MarkerFamily::ALL {
            let cells = marker_cells(MarkerId::new(family, 1)).expect("exists");
            let (center, cell) = (0.5 * family.print_cells() as f32, family.square_cells() as f32);
            let at = |from_center: f32| cells[center as usize][(center + from_center * cell) as usize];
            assert!(at(family.white_ring()) && at(-family.white_ring()), "{family}: {cells:?}");
            let black = 1.0 - family.white_ring();
            assert!(!at(black) && !at(-black), "{family}: {cells:?}");
        }
        assert_eq!(marker_cells(587), None);
    }

    #[test]
    fn fewer_bits_are_found_more_often_by_chance() {
        assert!((chance(MarkerFamily::Tag16h5, 0) - 30.0 * 4.0 / 65536.0).abs() < 1e-12);
        let words = 1.0 + 36.0 + 36.0 * 35.0 / 2.0;
        assert!((chance(MarkerFamily::Tag36h11, 2) - 587.0 * 4.0 * words / 36f64.exp2()).abs() < 1e-12);
        for family in MarkerFamily::ALL {
            let chance = chance(family, max_corrected_bits(family) as u32);
            assert!(chance < 2e-4 || family == MarkerFamily::Tag16h5, "{family}: {chance}");
        }
    }

    #[test]
    fn one_square_is_one_marker() {
        let marker = |family, size: f64, corrected_bits| {
            let corners = [(-size, -size), (size, -size), (size, size), (-size, size)].map(DVec2::from);
            DetectedMarker { family, id: 0, corners, corrected_bits }
        };
        let clear = marker(MarkerFamily::Tag36h11, 10.0, 0);
        let odd = marker(MarkerFamily::Tag16h5, 10.5, 0);
        let same = marker(MarkerFamily::Tag36h11, 4.0, 0);
        assert_eq!(without_overlaps(vec![odd.clone(), clear.clone(), same.clone()]), [clear, same]);
        assert_eq!(without_overlaps(vec![odd.clone()]), [odd]);
    }
}
