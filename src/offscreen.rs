//! Rendering without a window: for tools, tests and servers.
//!
//! Everything in this crate runs headless, on software Vulkan too. This module saves each headless program the same thirty
//! lines: an [`App`] without window and event loop, a texture to render into, and a way to get textures back to the CPU.
//!
//! Shaders are assets that load in the background, so the first few frames of an app may lack passes: [`settle`] waits for them,
//! [`update_until`] for anything else. Both, and all that reads textures, have their deadlines in seconds, since frames in which
//! nothing is drawn take no time.

use crate::{
    camera::unpad_rows,
    device::{self, DeviceState, MAX_BUSY_TIME, WaitBeforeDrop},
};
use bevy::{
    app::{PanicHandlerPlugin, PluginGroupBuilder},
    asset::RenderAssetUsages,
    camera::RenderTarget,
    core_pipeline::CorePipelinePlugin,
    diagnostic::{DiagnosticsPlugin, FrameCountPlugin},
    ecs::observer::On,
    gltf::GltfPlugin,
    input::InputPlugin,
    light::LightPlugin,
    mesh::MeshPlugin,
    pbr::PbrPlugin,
    platform::collections::HashSet,
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        gpu_readback::{Readback, ReadbackComplete},
        render_resource::{
            CachedPipeline, Extent3d, PipelineCache, PipelineDescriptor, TextureDimension, TextureFormat, TextureUsages,
        },
        renderer::RenderDevice,
    },
    time::TimePlugin,
    window::ExitCondition,
    world_serialization::WorldSerializationPlugin,
};
use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

/// Why a headless program cannot render.
#[derive(thiserror::Error, Debug)]
pub enum OffscreenError {
    /// There is no graphics adapter, not even a software one.
    #[error(
        "no graphics adapter: {0}. Install a Vulkan driver; the package mesa-vulkan-drivers has one that needs no GPU"
    )]
    NoAdapter(String),
    /// A texture did not come back from the GPU.
    #[error(
        "a texture did not come back from the GPU, which has nothing left to do; does it exist and has it the usage COPY_SRC? With logging on, Bevy may say why rendering stopped"
    )]
    NoAnswer,
    /// The GPU is still busy.
    #[error(
        "the graphics device has not finished a frame within {0:?}: its driver hangs, or the picture is far too large for it. Try a smaller picture, a newer driver, or another one named by VK_DRIVER_FILES"
    )]
    Hung(Duration),
    /// Rendering has ended.
    #[error(
        "rendering has stopped: the graphics device was lost or refused a command, and Bevy's log says why. Start again; if it happens once more, try a smaller picture, a newer driver, or another one named by VK_DRIVER_FILES"
    )]
    Stopped,
    /// Something was waited for in vain.
    #[error("{0} did not happen within {1:?}")]
    TooLate(&'static str, Duration),
}

/// Frames in which a texture arrives once the GPU is idle, and some more.
const MAX_IDLE_FRAMES: u32 = 16;
/// Frames without anything to compile after which all pipelines are there.
const QUIET_FRAMES: u32 = 4;

/// The part of Bevy's default plugins that draws, for a program without a window: no event loop, no sound, no
/// pipelined rendering (a frame is finished when [`App::update`] returns), pipelines compiled as soon as their shaders are
/// loaded. What else a game needs from [`DefaultPlugins`] (animation, for one) it adds itself. Logging is left to the program,
/// since there can be only one logger in a process.
pub fn default_plugins() -> PluginGroupBuilder {
    OffscreenPlugins.build()
}

/// Picked one by one: what [`DefaultPlugins`] holds depends on the Bevy features of the whole program, and a plugin can only be
/// left out of it by a type that may not exist in this build.
struct OffscreenPlugins;

impl PluginGroup for OffscreenPlugins {
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
    }
}

/// Builds a headless app from plugins ([`default_plugins`], adapted as needed), lets `configure` add to it, and makes it
/// ready for [`App::update`].
///
/// # Errors
/// [`OffscreenError::NoAdapter`] if there is nothing to render with.
pub fn build_app(plugins: PluginGroupBuilder, configure: impl FnOnce(&mut App)) -> Result<App, OffscreenError> {
    // Bevy panics without an adapter, and only there does it tell.
    let build = std::panic::AssertUnwindSafe(|| {
        let mut app = App::new();
        app.add_plugins(plugins);
        app
    });
    let mut app = std::panic::catch_unwind(build).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        OffscreenError::NoAdapter(text.unwrap_or("the renderer could not be started").to_owned())
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
/// [`OffscreenError::Stopped`] if Bevy ends the app, as it does when the device is lost.
pub fn update(app: &mut App) -> Result<(), OffscreenError> {
    app.update();
    match app.should_exit() {
        Some(AppExit::Error(_)) => Err(OffscreenError::Stopped),
        _ => Ok(()),
    }
}

/// Renders frame after frame until `done` says so, which is asked after each.
///
/// # Errors
/// [`OffscreenError::TooLate`] with `what`, if that takes longer than `patience`; as [`update`].
pub fn update_until(
    app: &mut App,
    what: &'static str,
    patience: Duration,
    mut done: impl FnMut(&mut App) -> bool,
) -> Result<(), OffscreenError> {
    let started = Instant::now();
    loop {
        update(app)?;
        // Frames are drawn faster than a slow device finishes them: what waits would be taken for a device that hangs.
        match app.world().get_resource::<RenderDevice>().map(|device| device::wait(device, MAX_BUSY_TIME)) {
            Some(DeviceState::Busy) => return Err(OffscreenError::Hung(MAX_BUSY_TIME)),
            Some(DeviceState::Lost) => return Err(OffscreenError::Stopped),
            Some(DeviceState::Idle) | None => (),
        }
        if done(app) {
            return Ok(());
        }
        if started.elapsed() > patience {
            return Err(OffscreenError::TooLate(what, patience));
        }
        // What is waited for needs the processor more than the next frame does.
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Renders frames until all shaders that these ask for have loaded and are compiled.
///
/// # Errors
/// As [`update_until`].
pub fn settle(app: &mut App) -> Result<(), OffscreenError> {
    let mut quiet = 0;
    update_until(app, "loading all shaders", MAX_BUSY_TIME, |app| {
        let pipelines = app.get_sub_app(RenderApp).and_then(|app| app.world().get_resource::<PipelineCache>());
        let is_waiting = pipelines.is_some_and(has_pipelines_on_their_way);
        quiet = if is_waiting { 0 } else { quiet + 1 };
        quiet >= QUIET_FRAMES
    })
}

/// Whether a pipeline waits for a shader that loads. Shaders with a fixed name are there from the start or never: Bevy asks for
/// some that small devices do not have.
fn has_pipelines_on_their_way(cache: &PipelineCache) -> bool {
    let waiting: HashSet<usize> = cache.waiting_pipelines().collect();
    let loads = |pipeline: &CachedPipeline| match &pipeline.descriptor {
        PipelineDescriptor::RenderPipelineDescriptor(of) => !matches!(of.vertex.shader.id(), AssetId::Uuid { .. }),
        PipelineDescriptor::ComputePipelineDescriptor(of) => !matches!(of.shader.id(), AssetId::Uuid { .. }),
    };
    cache.pipelines().enumerate().any(|(id, pipeline)| waiting.contains(&id) && loads(pipeline))
}

/// Adds a texture to render into (8-bit sRGB) and returns it with the component that points a camera at it.
pub fn add_target(app: &mut App, size: UVec2) -> (Handle<Image>, RenderTarget) {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
    image.texture_descriptor.label = Some("mirrorball_offscreen_target");
    image.texture_descriptor.usage =
        TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
    let handle = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    (handle.clone(), RenderTarget::Image(handle.into()))
}

/// Renders one frame and returns the bytes of a texture's first mip level after it: rows without padding, from top to
/// bottom, layer after layer. Cameras pause while the answer is awaited.
///
/// # Errors
/// [`OffscreenError::NoAnswer`] if the texture does not exist or cannot be copied from; [`OffscreenError::Hung`] if the GPU takes
/// two minutes over a frame; as [`update`].
pub fn read_texture(app: &mut App, image: &Handle<Image>) -> Result<Vec<u8>, OffscreenError> {
    let mut texture = Vec::new();
    record(app, image, 1, |_, _| (), |_, bytes| texture = bytes)?;
    Ok(texture)
}

/// Pictures that have come back from the GPU, in order.
#[derive(Resource, Default)]
struct ReadbackAnswers(VecDeque<Vec<u8>>);

/// Renders frame after frame and hands each one's texture out as in [`read_texture`]. `after_update` is called with the number
/// of each frame as soon as it is drawn, `on_picture` with the same number when its bytes have arrived, a frame or two later.
///
/// # Errors
/// [`OffscreenError::NoAnswer`] if the texture does not exist or cannot be copied from; [`OffscreenError::Hung`] if the GPU takes
/// two minutes over a frame; as [`update`].
pub fn record(
    app: &mut App,
    image: &Handle<Image>,
    frames: u32,
    mut after_update: impl FnMut(&mut App, u32),
    mut on_picture: impl FnMut(u32, Vec<u8>),
) -> Result<(), OffscreenError> {
    app.insert_resource(ReadbackAnswers::default());
    let request = app
        .world_mut()
        .spawn(Readback::texture(image.clone()))
        .observe(|answer: On<ReadbackComplete>, mut all: ResMut<ReadbackAnswers>| all.0.push_back(answer.data.clone()))
        .id();
    let mut arrived = 0;
    let mut take_arrived = |app: &mut App| {
        while let Some(bytes) = app.world_mut().resource_mut::<ReadbackAnswers>().0.pop_front() {
            let row = row_bytes(app, image).unwrap_or(bytes.len());
            on_picture(arrived, unpad_rows(&bytes, row));
            arrived += 1;
        }
        arrived
    };
    let mut outcome = Ok(());
    for frame in 0..frames {
        outcome = update(app);
        if outcome.is_err() {
            break;
        }
        after_update(app, frame);
        take_arrived(app);
    }
    app.world_mut().entity_mut(request).remove::<Readback>();
    let paused = pause_cameras(app.world_mut());
    if outcome.is_ok() {
        outcome = wait_for_pictures(app, MAX_BUSY_TIME, |app| take_arrived(app) as usize, frames as usize);
    }
    for camera in paused {
        if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
            camera.is_active = true;
        }
    }
    app.world_mut().despawn(request);
    outcome
}

/// Updates until a number of pictures has arrived, as long as the device is busy and finishes one now and then.
fn wait_for_pictures(
    app: &mut App,
    patience: Duration,
    mut arrived: impl FnMut(&mut App) -> usize,
    wanted: usize,
) -> Result<(), OffscreenError> {
    let (mut known, mut last_news, mut idle) = (0, Instant::now(), 0);
    loop {
        let now = arrived(app);
        if now >= wanted {
            return Ok(());
        }
        if now > known {
            (known, last_news, idle) = (now, Instant::now(), 0);
        }
        let Some(device) = app.world().get_resource::<RenderDevice>().cloned() else {
            return Err(OffscreenError::NoAnswer);
        };
        match device::wait(&device, Duration::from_millis(500).min(patience)) {
            DeviceState::Idle if idle >= MAX_IDLE_FRAMES => return Err(OffscreenError::NoAnswer),
            DeviceState::Idle => idle += 1,
            DeviceState::Busy if last_news.elapsed() > patience => return Err(OffscreenError::Hung(patience)),
            DeviceState::Busy => (),
            DeviceState::Lost => return Err(OffscreenError::Stopped),
        }
        update(app)?;
    }
}

/// Bytes of a row of a texture.
fn row_bytes(app: &App, image: &Handle<Image>) -> Option<usize> {
    let texture = &app.world().resource::<Assets<Image>>().get(image)?.texture_descriptor;
    let pixel = texture.format.block_copy_size(None).unwrap_or(4);
    Some((texture.size.width * pixel) as usize)
}

fn pause_cameras(world: &mut World) -> Vec<Entity> {
    let mut paused = Vec::new();
    for (entity, mut camera) in world.query::<(Entity, &mut Camera)>().iter_mut(world) {
        if camera.is_active {
            camera.is_active = false;
            paused.push(entity);
        }
    }
    paused
}
