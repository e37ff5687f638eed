//! Logging of programs without a window.

use bevy::log::LogPlugin;

/// Logs warnings. Most machines without a display have a software driver; the notices of Bevy and wgpu about it do not
/// help the user, so that only their errors are logged.
pub(crate) fn headless_log() -> LogPlugin {
    LogPlugin { filter: "warn,bevy_render=error,wgpu=error,naga=error".to_owned(), ..LogPlugin::default() }
}
