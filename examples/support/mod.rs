//! What the examples share: Bevy's default plugins with or without a window, `main` of programs for the command line,
//! parts of command lines, and captions of pictures.

#![allow(dead_code, unused_imports, reason = "each example uses a part, and which one differs")]

mod asset_path;
pub(crate) mod captions;
#[cfg(not(target_arch = "wasm32"))]
mod default_plugins;
#[cfg(not(target_arch = "wasm32"))]
mod draw_to_file;
mod exit_code;
#[cfg(not(target_arch = "wasm32"))]
mod fits_device;
mod has_display;
mod has_loaded;
mod headless_log;
mod loading_error;
mod parse_intrinsics;
mod parse_size;
mod rgb_image;
mod scene_path;
mod window_log;

pub(crate) use asset_path::asset_path;
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use default_plugins::DefaultPlugins;
pub(crate) use exit_code::{Outcome, exit_code, run_with_options};
#[cfg(not(target_arch = "wasm32"))]
pub(crate) use fits_device::fits_device;
pub(crate) use has_display::has_display;
pub(crate) use has_loaded::has_loaded;
pub(crate) use headless_log::headless_log;
pub(crate) use loading_error::loading_error;
pub(crate) use parse_intrinsics::parse_intrinsics;
pub(crate) use parse_size::parse_size;
pub(crate) use rgb_image::rgb_image;
pub(crate) use scene_path::scene_path;
pub(crate) use window_log::window_log;
