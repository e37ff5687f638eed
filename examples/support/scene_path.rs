//! Paths that users give as assets.

use bevy::{asset::AssetPath, gltf::GltfAssetLabel};
use std::path::{Path, PathBuf};

/// Returns the first scene of a glTF file as an asset in the file's own folder (in a browser, among the page's
/// assets), or `None` if the path names no file. Characters that mean something in asset paths (`#`, `://`) are part
/// of the name here.
pub(crate) fn scene_path(file: &Path) -> Option<AssetPath<'static>> {
    let name = if cfg!(target_arch = "wasm32") { file.into() } else { PathBuf::from(file.file_name()?) };
    let name = AssetPath::from_path_buf(name);
    Some(GltfAssetLabel::Scene(0).from_asset(name))
}
