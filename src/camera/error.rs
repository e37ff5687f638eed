//! What can go wrong with camera feeds.

use std::path::PathBuf;

/// What can go wrong on the way from a source to a picture.
#[derive(thiserror::Error, Debug)]
pub enum CameraError {
    /// A picture file could not be read or decoded.
    #[error("cannot read the image {path}: {source}. Give a PNG, JPEG or Radiance file that other programs can open")]
    File {
        /// The file as it was named.
        path: PathBuf,
        /// What the decoder said.
        source: image::ImageError,
    },
    /// A clip's folder or its sidecar could not be read.
    #[error(
        "cannot read {path}: {source}. A clip is a folder of JPEG or PNG files with a sidecar clip.json beside them"
    )]
    ClipUnreadable {
        /// The folder or file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A clip's sidecar is not what it has to be.
    #[error(
        "{path}: {source}. It needs \"image\": [width, height] and \"fps\"; \
         \"intrinsics\": {{\"fx\", \"fy\", \"cx\", \"cy\"}} in pixels, \
         \"pattern\": \"frame_*.jpg\" and \"exposures\": [1, 1, 0.125] are optional"
    )]
    ClipSidecar {
        /// The sidecar.
        path: PathBuf,
        /// What is wrong, with field, line and column.
        source: serde_json::Error,
    },
    /// A number of a clip's sidecar makes no sense.
    #[error("{path}: \"{field}\" is {found}; it has to be {expected}")]
    ClipValue {
        /// The sidecar.
        path: PathBuf,
        /// The field.
        field: &'static str,
        /// Its value.
        found: String,
        /// What it has to be.
        expected: &'static str,
    },
    /// A clip has no pictures.
    #[error("no images named {pattern} in {folder}; put JPEG or PNG files there or correct \"pattern\" in clip.json")]
    ClipEmpty {
        /// The clip's folder.
        folder: PathBuf,
        /// The names that were looked for.
        pattern: String,
    },
    /// A feed's exposure cannot be.
    #[error(
        "the exposure of CameraFeed::with_exposure is {0}; it has to be above 0 and at most 1, the exposure \
         of a normal frame"
    )]
    Exposure(f32),
    /// An image asset cannot be used as a camera frame.
    #[error("the image cannot be used as a camera frame: {0}")]
    Image(String),
}
