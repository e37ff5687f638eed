//! Errors of scenes that load in the background.

use bevy::{
    asset::{LoadState, RecursiveDependencyLoadState},
    prelude::*,
};
use std::path::Path;

/// Returns why the scene of `file`, or something that it refers to, cannot be loaded; `None` if it is loaded or still
/// loading.
pub(crate) fn loading_error(assets: &AssetServer, scene: &Handle<WorldAsset>, file: &Path) -> Option<String> {
    if let Some(LoadState::Failed(error)) = assets.get_load_state(scene) {
        return Some(format!("cannot load {}: {error}", file.display()));
    }
    match assets.get_recursive_dependency_load_state(scene) {
        Some(RecursiveDependencyLoadState::Failed(error)) => {
            Some(format!("cannot load what {} refers to: {error}", file.display()))
        }
        _ => None,
    }
}
