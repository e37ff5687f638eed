//! Whether scenes are loaded.

use bevy::prelude::*;

/// Returns whether no scene is loading any more. Those that cannot be loaded are in the log.
pub(crate) fn has_loaded(world: &mut World) -> bool {
    let assets = world.resource::<AssetServer>().clone();
    world.query::<&WorldAssetRoot>().iter(world).all(|scene| {
        assets.get_recursive_dependency_load_state(&scene.0).is_none_or(|state| state.is_loaded() || state.is_failed())
    })
}
