//! Errors of tracking.

use super::{MarkerFamily, MarkerId};

/// Errors of tracking. A marker that is not in view is not an error.
#[derive(thiserror::Error, Debug, PartialEq)]
#[non_exhaustive]
pub enum TrackingError {
    /// The crate was built without a detector and the game has not inserted one.
    #[error("no marker detector: enable the feature `apriltag` or `locus`, or insert the resource MarkerDetection")]
    NoDetector,
    /// The linked AprilTag library is not the version whose memory layout this crate knows.
    #[error(
        "the linked AprilTag library is not version 3.4.5: set the environment variable APRILTAG_SYS_METHOD=raw,static \
         when building, so that the version that comes with the crate apriltag-sys is compiled"
    )]
    WrongLibrary,
    /// The AprilTag library could not allocate memory.
    #[error("the AprilTag library is out of memory")]
    OutOfMemory,
    /// The marker family has no such number.
    #[error("{} has no marker number {}; numbers go from 0 to {}", .0.family, .0.id, .0.family.marker_count() - 1)]
    NoSuchMarker(MarkerId),
    /// No marker family has such a name.
    #[error("there is no marker family {0:?}; families are {all}", all = MarkerFamily::ALL.map(MarkerFamily::name).join(", "))]
    NoSuchFamily(String),
    /// The detector does not know a marker family.
    #[error("this detector does not know the family {0}: enable the feature `apriltag`, or use tag36h11")]
    UnknownToDetector(MarkerFamily),
    /// The size of a marker is not a length above 0, or the marker does not fit the page.
    #[error("a marker cannot be {0} meters wide; give the side of its black square, above 0")]
    BadSize(f32),
    /// A marker is twice on a board, counting that of the anchor.
    #[error("{0} is on the board twice; give each of its markers another number")]
    DuplicateMarker(MarkerId),
    /// The place of a marker on its board is not finite.
    #[error("the place of {0} on its board is not finite; give meters and a rotation of length 1")]
    BadPlace(MarkerId),
    /// A marker is not in the plane of the sheet on which it should be printed.
    #[error("{0} is not in the plane of the sheet and cannot be printed on it; print it on a sheet of its own")]
    NotInPlane(MarkerId),
    /// A marker does not fit its side of a box. Lengths in millimeters.
    #[error(
        "the print of {marker} is {print:.1} mm wide, and its side of the box {side:.1} mm: make the box larger or the \
        marker smaller"
    )]
    BoxTooSmall {
        /// The marker.
        marker: MarkerId,
        /// Width of its print.
        print: f32,
        /// Shorter edge of the side.
        side: f32,
    },
    /// A sheet does not fit the page. Width and height in millimeters.
    #[error(
        "{:.0} × {:.0} mm are needed with free edges and captions, and there are {:.0} × {:.0} mm: take larger paper or \
         turn it, or make the markers smaller", .needed.0, .needed.1, .page.0, .page.1
    )]
    DoesNotFit {
        /// What is needed.
        needed: (f32, f32),
        /// What there is.
        page: (f32, f32),
    },
    /// The name of a paper size is unknown.
    #[error("there is no paper size {0:?}; write A5, A4, A3, Letter, one of them with -landscape, or as 200x150 in mm")]
    NoSuchPaper(String),
}
