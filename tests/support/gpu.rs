//! Headless apps for tests that need a graphics adapter.

use bevy::{app::PluginGroupBuilder, prelude::*};
use bevy_mirrorball::offscreen;

/// A headless app, or `None` with a printed reason where there is nothing to render with. With `MIRRORBALL_REQUIRE_GPU`
/// set (as in CI) that is a failure.
pub(crate) fn app(configure: impl FnOnce(&mut App)) -> Option<App> {
    app_with(offscreen::default_plugins(), configure)
}

/// The same with other plugins.
pub(crate) fn app_with(plugins: PluginGroupBuilder, configure: impl FnOnce(&mut App)) -> Option<App> {
    match offscreen::build_app(plugins, configure) {
        Ok(app) => Some(app),
        Err(error) if std::env::var_os("MIRRORBALL_REQUIRE_GPU").is_none() => {
            println!("skipped: {error}");
            None
        }
        Err(error) => panic!("MIRRORBALL_REQUIRE_GPU is set, but: {error}"),
    }
}
