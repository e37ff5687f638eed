//! Relative paths of files that a game reads.

use std::path::{Path, PathBuf};

/// Folder in which Bevy's `assets` folder is, as its file assets find it: `BEVY_ASSET_ROOT`, the package when `cargo`
/// runs the game, else the folder of the executable.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn asset_root() -> PathBuf {
    bevy::asset::io::file::FileAssetReader::get_base_path()
}

/// Without a file system there is no such folder.
#[cfg(target_arch = "wasm32")]
pub(crate) fn asset_root() -> PathBuf {
    PathBuf::new()
}

/// Where a path leads: absolute ones, and those that exist in the working directory, as they are; others from the
/// [`asset_root`]. `None` if there is nothing.
pub(crate) fn locate(path: &Path) -> Option<PathBuf> {
    locate_from(path, asset_root)
}

fn locate_from(path: &Path, asset_root: impl FnOnce() -> PathBuf) -> Option<PathBuf> {
    if path.is_absolute() || path.exists() {
        return Some(path.to_owned());
    }
    let in_root = asset_root().join(path);
    in_root.exists().then_some(in_root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_working_directory_comes_before_the_asset_root() {
        // Tests run in the folder of the package.
        let root = || Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        let located = |path: &str| locate_from(Path::new(path), root);
        assert_eq!(located("src/camera"), Some("src/camera".into()));
        assert_eq!(located("camera"), Some(root().join("camera")));
        assert_eq!(located("no such file"), None);
        let absolute = if cfg!(windows) { r"C:\no such file" } else { "/no such file" };
        assert_eq!(located(absolute), Some(absolute.into()), "who gives one gets the error of the system");
    }
}
