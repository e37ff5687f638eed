//! Paths of the files that come with the examples.

use std::path::{Path, PathBuf};

/// Path of an asset of the package, independent of the folder in which cargo runs the program.
pub(crate) fn asset_path(name: &str) -> PathBuf {
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(PathBuf::new, PathBuf::from);
    package.join("assets").join(Path::new(name))
}
