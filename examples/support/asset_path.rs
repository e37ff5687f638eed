//! Paths of the files that come with the examples.

use std::path::{Path, PathBuf};

/// Path of an asset of the package, independent of the folder in which cargo runs the program. In a browser it starts
/// where the page has its assets.
pub(crate) fn asset_path(name: &str) -> PathBuf {
    if cfg!(target_arch = "wasm32") {
        return name.into();
    }
    let package = std::env::var_os("CARGO_MANIFEST_DIR").map_or_else(PathBuf::new, PathBuf::from);
    package.join("assets").join(Path::new(name))
}
