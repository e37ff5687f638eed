//! Errors of calibration and of the files with its result.

use bevy::prelude::*;
use std::path::PathBuf;

/// Errors of calibration and of the files with its result.
#[derive(thiserror::Error, Debug)]
#[non_exhaustive]
pub enum CalibrationError {
    /// A file could not be read or written.
    #[error("cannot access {path}: {source}")]
    File {
        /// Path as it was given.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A JSON file is malformed.
    #[error(
        "{path}: {source}. It needs \"image\": [width, height] and \"intrinsics\": {{\"fx\", \"fy\", \"cx\", \"cy\"}} in pixels; \
         \"k1\", \"k2\", \"p1\", \"p2\" and \"k3\" among them are optional"
    )]
    Json {
        /// Path of the file.
        path: PathBuf,
        /// Error of the parser, with field, line and column.
        source: serde_json::Error,
    },
    /// A field is missing or has a value that cannot be.
    #[error("{path}: \"{field}\" is {found}; it has to be {expected}")]
    Value {
        /// Path of the file.
        path: PathBuf,
        /// Name of the field.
        field: &'static str,
        /// Its value, or that it is missing.
        found: String,
        /// Values that are valid.
        expected: &'static str,
    },
    /// There are not enough views of the board.
    #[error(
        "only {usable} of {views} views show enough of the board, and {} are needed; show it whole, sharp and flat",
        super::MIN_VIEWS
    )]
    TooFewViews {
        /// Views that were given.
        views: usize,
        /// Views with enough points.
        usable: usize,
    },
    /// The views do not determine the lens.
    #[error(
        "the views do not determine the lens: {0}. Hold the board at different slants of 20° to 45°, to each side, and near all \
         borders of the frame"
    )]
    Undetermined(&'static str),
    /// Frames of different sizes.
    #[error("frames of {} × {} and of {} × {} pixels are given; calibrate with frames of one size", .0.x, .0.y, .1.x, .1.y)]
    Sizes(UVec2, UVec2),
    /// A board that cannot be printed or detected.
    #[error("the board cannot be: {0}")]
    Board(String),
    /// The marker detector could not be set up.
    #[error(transparent)]
    Detector(#[from] crate::tracking::TrackingError),
}
