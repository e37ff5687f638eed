//! Rendering without a window, for tools, tests and servers. Not for the web, where a program cannot wait for the
//! graphics device: the module is not there.
//!
//! Everything in this crate runs headless, also on software Vulkan. This module replaces the thirty lines that each
//! headless program would need: an [`App`](bevy::app::App) without window and event loop, a texture to render into,
//! and readback of textures to the CPU.
//!
//! Shaders are assets that load in the background, so the first few frames of an app may lack passes. [`settle`] waits
//! for shaders, [`update_until`] for any other condition. Both, and all functions that read textures, have their
//! deadlines in seconds, because frames in which nothing is drawn take no time.

mod app;
mod device_wait;
mod readback;
mod settle;
mod target;

pub use {
    app::{build_app, default_plugins, update},
    readback::{read_texture, record},
    settle::{settle, update_until},
    target::{add_target, max_texture_edge},
};

use std::time::Duration;

/// Errors of headless rendering.
#[derive(thiserror::Error, Debug)]
#[non_exhaustive]
pub enum HeadlessError {
    /// There is no graphics adapter, not even a software one.
    #[error(
        "no graphics adapter: {0}. Install a Vulkan driver; the package mesa-vulkan-drivers has one that needs no GPU"
    )]
    NoAdapter(String),
    /// A texture did not come back from the GPU.
    #[error(
        "a texture did not come back from the GPU, which has nothing left to do. It has to exist and to have the usage \
         COPY_SRC. With logging on, Bevy may say why rendering stopped"
    )]
    NoAnswer,
    /// The GPU is still busy.
    #[error(
        "the graphics device has not finished a frame within {0:?}: its driver hangs, or the image is far too large \
         for it. Try a smaller image, a newer driver, or another one named by VK_DRIVER_FILES"
    )]
    Hung(Duration),
    /// Rendering has stopped.
    #[error(
        "rendering has stopped: the graphics device was lost or refused a command, and Bevy's log says why. Start again; if \
         it happens once more, try a smaller image, a newer driver, or another one named by VK_DRIVER_FILES"
    )]
    Stopped,
    /// A pipeline cannot be compiled, so that what it draws would be missing.
    #[error("the pipeline {pipeline:?} cannot be compiled: {reason}")]
    Pipeline {
        /// Label of the pipeline.
        pipeline: String,
        /// Message of the shader compiler, or what the pipeline waits for in vain.
        reason: String,
    },
    /// A condition was not met in time.
    #[error("{0} did not happen within {1:?}")]
    TooLate(&'static str, Duration),
}
