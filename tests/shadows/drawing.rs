//! Apps that draw virtual objects into frames, without marker tracking and light solver.

use crate::gpu;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::CameraPlugin, materials::MaterialsPlugin, phantom::PhantomPlugin, prefilter::PrefilterPlugin,
    probe::ProbePlugin, shadows::ShadowsPlugin, unwrap::UnwrapPlugin,
};

/// A headless app, or `None` with a printed reason where there is nothing to render with.
pub(crate) fn app() -> Option<App> {
    app_with(|_| ())
}

/// The same with what a game adds.
pub(crate) fn app_with(configure: impl FnOnce(&mut App)) -> Option<App> {
    gpu::app(|app| {
        app.add_plugins((
            CameraPlugin,
            PhantomPlugin,
            ProbePlugin,
            UnwrapPlugin,
            PrefilterPlugin,
            ShadowsPlugin,
            MaterialsPlugin,
        ));
        configure(app);
    })
}
