//! Logging of programs with a window.

use bevy::log::LogPlugin;

/// Logs warnings, and only errors of the libraries for windows and graphics.
pub(crate) fn window_log() -> LogPlugin {
    LogPlugin { filter: "warn,wgpu=error,winit=error,bevy_egui=error".to_owned(), ..LogPlugin::default() }
}
