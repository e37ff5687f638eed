//! Errors of camera feeds.

use std::path::PathBuf;

/// Errors on the way from a source to a frame.
#[derive(thiserror::Error, Debug)]
#[non_exhaustive]
pub enum CameraError {
    /// A relative path leads nowhere.
    #[error(
        "cannot find {path}: it is neither in the working directory, {working_directory}, nor in {asset_root}, where \
         Bevy looks for the folder of assets. Give the path of {expected}"
    )]
    NotFound {
        /// Path as the game gave it.
        path: PathBuf,
        /// Folder in which the program was started.
        working_directory: PathBuf,
        /// Folder that Bevy's file assets start from.
        asset_root: PathBuf,
        /// What has to be there.
        expected: &'static str,
    },
    /// An image file could not be read or decoded.
    #[error(
        "cannot read the image {path}: {source}. Give a PNG, JPEG, Radiance or OpenEXR file that other programs can open"
    )]
    File {
        /// Path as the game gave it.
        path: PathBuf,
        /// Error of the decoder.
        source: image::ImageError,
    },
    /// The folder or the sidecar of a clip could not be read.
    #[error(
        "cannot read {path}: {source}. A clip is a folder of JPEG or PNG files with a sidecar clip.json beside them"
    )]
    ClipUnreadable {
        /// Path of the folder or file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The sidecar of a clip is malformed.
    #[error(
        "{path}: {source}. It needs \"image\": [width, height] and \"fps\"; \
         \"intrinsics\": {{\"fx\", \"fy\", \"cx\", \"cy\"}} in pixels with the distortion \"k1\" to \"k3\", \
         \"pattern\": \"frame_*.jpg\" and \"exposures\": [1, 1, 0.125] are optional"
    )]
    ClipSidecar {
        /// Path of the sidecar.
        path: PathBuf,
        /// Error of the parser, with field, line and column.
        source: serde_json::Error,
    },
    /// A value in the sidecar of a clip is out of range.
    #[error("{path}: \"{field}\" is {found}; it has to be {expected}")]
    ClipValue {
        /// Path of the sidecar.
        path: PathBuf,
        /// Name of the field.
        field: &'static str,
        /// Its value.
        found: String,
        /// Values that are valid.
        expected: &'static str,
    },
    /// A clip could not be loaded as an asset.
    #[error("cannot load the clip: {reason}")]
    ClipAsset {
        /// What went wrong, with the path of the asset.
        reason: String,
    },
    /// A clip has no images.
    #[error("no images named {pattern} in {folder}; put JPEG or PNG files there or correct \"pattern\" in clip.json")]
    ClipEmpty {
        /// Folder of the clip.
        folder: PathBuf,
        /// Pattern that no file name matched.
        pattern: String,
    },
    /// The exposure of a feed is out of range.
    #[error(
        "the exposure of CameraFeed::with_exposure is {0}; it has to be above 0 and at most 1, the exposure \
         of a normal frame"
    )]
    Exposure(f32),
    /// An image asset cannot be used as a camera frame.
    #[error("the image cannot be used as a camera frame: {0}")]
    Image(String),
}
