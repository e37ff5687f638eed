//! Graphics devices: which one runs the tests, what the crate asks of one, and what happens if it lacks that or takes
//! its time.

use crate::gpu;
use bevy::{
    prelude::*,
    render::{
        RenderApp, RenderPlugin,
        render_resource::{
            BindGroupDescriptor, BindGroupEntry, BindGroupLayoutEntry, BindingType, BufferBindingType,
            BufferDescriptor, BufferUsages, CachedPipelineState, Pipeline, PipelineCache, PipelineDescriptor, PollType,
            RawComputePipelineDescriptor, ShaderModuleDescriptor, ShaderSource, ShaderStages, WgpuFeatures, WgpuLimits,
        },
        renderer::{RenderAdapterInfo, RenderDevice, RenderQueue},
        settings::{WgpuSettings, WgpuSettingsPriority},
    },
};
use bevy_mirrorball::{
    camera::FramePixels,
    debug::{MapView, ShownMap},
    headless,
    materials::SoftPhantomEdges,
    prelude::*,
    probe::UniformSky,
};
use std::time::{Duration, Instant};

#[test]
fn the_driver_is_named() {
    let Some(app) = gpu::app(|_| ()) else { return };
    let info = app.world().resource::<RenderAdapterInfo>();
    println!("driver: {}, {} {} ({:?})", info.name, info.driver, info.driver_info, info.backend);
    assert!(!info.name.is_empty());
}

/// Asks for exactly these limits and no optional feature, whatever else the adapter could do.
fn restricted(limits: WgpuLimits) -> RenderPlugin {
    let priority = WgpuSettingsPriority::WebGPU;
    let settings = WgpuSettings { priority, features: WgpuFeatures::empty(), limits, ..default() };
    RenderPlugin { render_creation: settings.into(), synchronous_pipeline_compilation: true, ..default() }
}

/// Asks for everything that the adapter can do, whatever the environment variable `WGPU_SETTINGS_PRIO` says.
pub(crate) fn unrestricted() -> RenderPlugin {
    let settings = WgpuSettings { priority: WgpuSettingsPriority::Functionality, ..default() };
    RenderPlugin { render_creation: settings.into(), synchronous_pipeline_compilation: true, ..default() }
}

/// A camera above a phantom desk with a virtual ball on it, of each style, and everything else that has a pass of its
/// own.
struct Scene {
    app: App,
    picture: Handle<Image>,
}

impl Scene {
    const SIZE: UVec2 = UVec2::new(96, 64);

    fn new(render: RenderPlugin) -> Option<Self> {
        let plugins = headless::default_plugins().set(render);
        let mut app = gpu::app_with(plugins, |app| {
            app.add_plugins(MirrorballPlugins);
        })?;
        let (picture, target) = headless::add_target(&mut app, Self::SIZE);
        let gray = FramePixels::new(Self::SIZE, vec![150; 4 * Self::SIZE.element_product() as usize]);
        let feed = CameraFeed::pixels(gray.expect("as many bytes as the size says")).with_pace(FeedPace::Lockstep);
        let intrinsics = Intrinsics::new(Vec2::splat(80.0), 0.5 * Self::SIZE.as_vec2(), Self::SIZE);
        let pose = Transform::from_xyz(0.0, 0.6, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
        let effects = (SoftPhantomEdges::default(), CameraGrain::default());
        app.world_mut().spawn((ArCamera::new(intrinsics), pose, feed, target, effects));
        let sky = UniformSky { radiance: Some(Vec3::splat(0.4)) };
        app.world_mut().spawn((LightProbeSphere::default(), sky, Transform::from_xyz(0.2, 0.05, 0.1)));
        app.world_mut().spawn(ShadowDomeLight::default());
        app.world_mut().spawn(PointLight { shadow_maps_enabled: true, ..default() });
        let view = MapView::new(ShownMap::Diffuse, &mut app.world_mut().resource_mut::<Assets<Image>>());
        app.world_mut().spawn(view);
        let mut scene = Self { app, picture };
        let desk = Plane3d::default().mesh().size(2.0, 2.0).build();
        scene.add(desk, Vec3::ZERO, PhantomObject { casts: false, ..default() });
        let ball = || Sphere::new(0.04).mesh().build();
        for (x, style) in [
            (-0.12, SurfaceStyle::ImageBased),
            (0.0, SurfaceStyle::Toon(ToonStyle::default())),
            (0.12, SurfaceStyle::Engine),
            (0.24, SurfaceStyle::Classic(ClassicStyle::default())),
        ] {
            let material = scene.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(Color::WHITE);
            scene.add(ball(), Vec3::new(x, 0.04, 0.0), (MeshMaterial3d(material), style));
        }
        Some(scene)
    }

    fn add(&mut self, mesh: Mesh, place: Vec3, extra: impl Bundle) {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.app.world_mut().spawn((Mesh3d(mesh), Transform::from_translation(place), extra));
    }

    fn shoot(&mut self) -> Vec<u8> {
        for _ in 0..8 {
            headless::update(&mut self.app).expect("rendering goes on");
        }
        headless::settle(&mut self.app).expect("all shaders compile");
        headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back")
    }
}

/// Bindings of one kind that a shader stage has in all its bind groups together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
struct Count {
    sampled_textures: u32,
    samplers: u32,
    storage_buffers: u32,
    uniform_buffers: u32,
    storage_textures: u32,
}

impl Count {
    fn of<'a>(entries: impl Iterator<Item = &'a BindGroupLayoutEntry>, stage: ShaderStages) -> Self {
        let mut count = Self::default();
        for entry in entries.filter(|entry| entry.visibility.contains(stage)) {
            let number = entry.count.map_or(1, |count| count.get());
            let kind = match entry.ty {
                BindingType::Texture { .. } => &mut count.sampled_textures,
                BindingType::Sampler(_) => &mut count.samplers,
                BindingType::StorageTexture { .. } => &mut count.storage_textures,
                BindingType::Buffer { ty: BufferBindingType::Uniform, .. } => &mut count.uniform_buffers,
                BindingType::Buffer { ty: BufferBindingType::Storage { .. }, .. } => &mut count.storage_buffers,
                _ => continue,
            };
            *kind += number;
        }
        count
    }

    fn fits(&self, limits: &WgpuLimits) -> bool {
        self.sampled_textures <= limits.max_sampled_textures_per_shader_stage
            && self.samplers <= limits.max_samplers_per_shader_stage
            && self.storage_buffers <= limits.max_storage_buffers_per_shader_stage
            && self.uniform_buffers <= limits.max_uniform_buffers_per_shader_stage
            && self.storage_textures <= limits.max_storage_textures_per_shader_stage
    }
}

/// Name, number of bind groups, and bindings of the fullest stage of each pipeline that an app has asked for.
fn pipelines(app: &App) -> Vec<(String, usize, Count)> {
    let cache = app.sub_app(RenderApp).world().resource::<PipelineCache>();
    let stages = [ShaderStages::VERTEX, ShaderStages::FRAGMENT, ShaderStages::COMPUTE];
    cache
        .pipelines()
        .flat_map(|pipeline| {
            let (label, layout) = match &pipeline.descriptor {
                PipelineDescriptor::RenderPipelineDescriptor(descriptor) => (&descriptor.label, &descriptor.layout),
                PipelineDescriptor::ComputePipelineDescriptor(descriptor) => (&descriptor.label, &descriptor.layout),
            };
            let name = label.as_ref().map_or_else(String::new, ToString::to_string);
            stages.map(|stage| {
                let entries = layout.iter().flat_map(|group| group.entries.iter());
                (format!("{name} {stage:?}"), layout.len(), Count::of(entries, stage))
            })
        })
        .collect()
}

#[test]
fn the_whole_crate_runs_with_webgpus_default_limits_and_no_optional_feature() {
    let limits = WgpuLimits::default();
    let Some(mut scene) = Scene::new(restricted(limits.clone())) else { return };
    let restrained = scene.shoot();
    let device = scene.app.world().resource::<RenderDevice>();
    assert_eq!((device.limits(), device.features()), (limits.clone(), WgpuFeatures::empty()));
    let found = pipelines(&scene.app);
    for wanted in ["unwrap", "gather_blocks", "weigh_cells", "visibility", "depth", "map_view", "soft_edges", "grain"] {
        assert!(found.iter().any(|(name, ..)| name.contains(wanted)), "{wanted} did not run");
    }
    for (name, groups, count) in &found {
        if *count != Count::default() && (name.contains("mirrorball") || count.sampled_textures > 10) {
            println!("{name}: {count:?}");
        }
        assert!(*groups <= 4 && count.fits(&limits), "{name}: {groups} groups, {count:?}");
    }
    let failed = scene.app.sub_app(RenderApp).world().resource::<PipelineCache>().pipelines().find(|pipeline| {
        !matches!(pipeline.state, CachedPipelineState::Ok(Pipeline::RenderPipeline(_) | Pipeline::ComputePipeline(_)))
    });
    assert!(failed.is_none(), "a pipeline was not made: {:?}", failed.map(|pipeline| &pipeline.state));

    let mut free = Scene::new(unrestricted()).expect("as before");
    let unrestrained = free.shoot();
    let worst = restrained.iter().zip(&unrestrained).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(1), "the pictures differ by {worst:?}");
    for (name, _, count) in pipelines(&free.app).iter().filter(|(.., count)| !count.fits(&limits)) {
        println!("beyond the limits natively, {name}: {count:?}");
    }
}

#[test]
fn a_device_that_lacks_what_a_stage_needs_draws_the_rest() {
    // Without storage textures nothing is measured or filtered, and there is no dome.
    let limits = WgpuLimits { max_storage_textures_per_shader_stage: 0, ..default() };
    let Some(mut scene) = Scene::new(restricted(limits)) else { return };
    let picture = scene.shoot();
    let pixel = |x: u32, y: u32| &picture[4 * (y * Scene::SIZE.x + x) as usize..][..3];
    assert_eq!(pixel(2, 2), [150; 3], "the camera's picture is behind everything");
    assert_eq!(pixel(48, 60), [150; 3], "and where a phantom would be");
}

/// Gives the device work for about some time.
fn keep_busy(app: &App, time: Duration) {
    // Short loops in many groups: software Vulkan ends loops of more than 65535 steps.
    const SPIN: &str = "
@group(0) @binding(0) var<storage, read_write> state: array<u32>;
@compute @workgroup_size(1)
fn spin(@builtin(workgroup_id) group: vec3u) {
    var x = group.x;
    for (var i = 0u; i < 60000u; i++) { x = (x ^ (x >> 7u)) * 1664525u + 1013904223u; }
    state[group.x % 64u] = x;
}";
    const MOST_GROUPS: u32 = 65_535;
    const TRIAL: u32 = 500;
    let (device, queue) = (app.world().resource::<RenderDevice>(), app.world().resource::<RenderQueue>());
    let source = ShaderSource::Wgsl(SPIN.into());
    let module = device.create_and_validate_shader_module(ShaderModuleDescriptor { label: None, source });
    let pipeline = device.create_compute_pipeline(&RawComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("spin"),
        compilation_options: default(),
        cache: None,
    });
    let state = device.create_buffer(&BufferDescriptor {
        label: None,
        size: 256,
        usage: BufferUsages::STORAGE,
        mapped_at_creation: false,
    });
    let bind_group = device.wgpu_device().create_bind_group(&BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[BindGroupEntry { binding: 0, resource: state.as_entire_binding() }],
    });
    let spin = |mut groups: u32| {
        let mut encoder = device.create_command_encoder(&default());
        {
            let mut pass = encoder.begin_compute_pass(&default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bind_group, &[]);
            while groups > 0 {
                pass.dispatch_workgroups(groups.min(MOST_GROUPS), 1, 1);
                groups = groups.saturating_sub(MOST_GROUPS);
            }
        }
        queue.submit([encoder.finish()]);
    };
    spin(1);
    device.poll(PollType::wait_indefinitely()).expect("an answer");
    let started = Instant::now();
    spin(TRIAL);
    device.poll(PollType::wait_indefinitely()).expect("an answer");
    spin((f64::from(TRIAL) * time.as_secs_f64() / started.elapsed().as_secs_f64()).min(1e7) as u32);
}

/// wgpu gives a device that much time to finish when it is dropped, and panics then.
const LONGER_THAN_WGPU_WAITS: Duration = Duration::from_secs(9);

#[test]
fn an_app_may_be_dropped_while_the_device_is_busy() {
    let Some(app) = gpu::app(|_| ()) else { return };
    // Bevy does not pass on the name of the type.
    if format!("{:?}", app.world().resource::<RenderAdapterInfo>().device_type) != "Cpu" {
        println!("skipped: graphics cards end work of that length by themselves");
        return;
    }
    keep_busy(&app, LONGER_THAN_WGPU_WAITS);
    drop(app);
}

#[test]
fn a_texture_that_is_not_there_is_no_endless_wait() {
    let Some(mut app) = gpu::app(|_| ()) else { return };
    let missing = app.world().resource::<Assets<Image>>().reserve_handle();
    let answer = headless::read_texture(&mut app, &missing);
    assert!(matches!(answer, Err(headless::HeadlessError::NoAnswer)), "{answer:?}");
}
