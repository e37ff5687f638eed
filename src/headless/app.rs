//! Apps without a window.

use super::{HeadlessError, device_wait::WaitBeforeDrop};
use crate::panic_text::panic_text;
use bevy::{
    app::{PanicHandlerPlugin, PluginGroupBuilder},
    core_pipeline::CorePipelinePlugin,
    diagnostic::{DiagnosticsPlugin, FrameCountPlugin},
    gizmos::GizmoPlugin,
    gltf::GltfPlugin,
    input::InputPlugin,
    light::LightPlugin,
    mesh::MeshPlugin,
    pbr::PbrPlugin,
    prelude::*,
    render::RenderPlugin,
    time::TimePlugin,
    window::ExitCondition,
    world_serialization::WorldSerializationPlugin,
};

/// The part of Bevy's default plugins that draws, for a program without a window.
///
/// There is no event loop, no sound and no pipelined rendering (a frame is finished when [`App::update`] returns), and
/// pipelines are compiled as soon as their shaders are loaded. Add whatever else a game needs from [`DefaultPlugins`],
/// for example animation: with Bevy's feature `gltf_animation`, animated glTF files do not load without its plugin.
/// Logging is left to the program, because a process can have only one logger.
pub fn default_plugins() -> PluginGroupBuilder {
    HeadlessPlugins.build()
}

/// Plugins listed one by one: the content of [`DefaultPlugins`] depends on the Bevy features of the whole program, and
/// a plugin can be removed from it only by a type that may not exist in this build.
struct HeadlessPlugins;

impl PluginGroup for HeadlessPlugins {
    fn build(self) -> PluginGroupBuilder {
        PluginGroupBuilder::start::<Self>()
            .add(PanicHandlerPlugin)
            .add(TaskPoolPlugin::default())
            .add(FrameCountPlugin)
            .add(TimePlugin)
            .add(TransformPlugin)
            .add(DiagnosticsPlugin)
            .add(InputPlugin)
            .add(WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() })
            .add(AssetPlugin::default())
            .add(WorldSerializationPlugin)
            .add(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
            .add(ImagePlugin::default())
            .add(MeshPlugin)
            .add(bevy::camera::CameraPlugin)
            .add(LightPlugin)
            .add(CorePipelinePlugin)
            .add(GltfPlugin::default())
            .add(PbrPlugin::default())
            // lights come with gizmos of their own, which need it
            .add(GizmoPlugin)
    }
}

/// Builds a headless app from plugins ([`default_plugins`], adapted as needed), calls `configure` on it, and makes it
/// ready for [`App::update`].
///
/// # Errors
/// [`HeadlessError::NoAdapter`] if there is no graphics adapter.
pub fn build_app(plugins: PluginGroupBuilder, configure: impl FnOnce(&mut App)) -> Result<App, HeadlessError> {
    // Without an adapter Bevy panics, and only the panic carries the reason.
    let build = std::panic::AssertUnwindSafe(|| {
        let mut app = App::new();
        app.add_plugins(plugins);
        app
    });
    let mut app = std::panic::catch_unwind(build).map_err(|panic| {
        HeadlessError::NoAdapter(panic_text(&*panic).unwrap_or("the renderer could not be started").to_owned())
    })?;
    configure(&mut app);
    while app.plugins_state() == bevy::app::PluginsState::Adding {
        bevy::tasks::tick_global_task_pools_on_main_thread();
    }
    app.finish();
    app.cleanup();
    WaitBeforeDrop::add(&mut app);
    Ok(app)
}

/// Renders one frame.
///
/// # Errors
/// [`HeadlessError::Stopped`] if Bevy ends the app, as it does when the device is lost.
pub fn update(app: &mut App) -> Result<(), HeadlessError> {
    app.update();
    match app.should_exit() {
        Some(AppExit::Error(_)) => Err(HeadlessError::Stopped),
        _ => Ok(()),
    }
}
