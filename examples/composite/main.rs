//! Composites virtual objects into a photograph: camera pose from the marker, light from the mirrored ball, shadows
//! from the dome or, for comparison, planar ones.
//!
//! ```text
//! cargo run --example composite -- --frame photo.png --intrinsics FX,FY,CX,CY --scene desk.glb --out out.png
//! ```
//! Run with `--help` for all options. Needs no window; renders on software Vulkan too.

mod options;
mod report;
#[path = "../support/mod.rs"]
mod support;

use bevy::{
    asset::{AssetPlugin, UnapprovedPathMode},
    prelude::*,
    render::diagnostic::RenderDiagnosticsPlugin,
};
use bevy_mirrorball::{
    authoring,
    camera::FramePixels,
    environment_map::{CubePixels, EnvironmentCube},
    headless::{self, HeadlessError},
    materials::NeighborReflections,
    prelude::*,
    probe::{ClipRecovery, ProbeMeasurement, UniformSky},
    shadows::PlanarShadow,
    tracking::{DetectedMarkers, MarkerState, MarkerTracking},
};
use options::{Options, Shadows, USAGE};
use report::Stopwatch;
use std::{
    path::Path,
    process::ExitCode,
    time::{Duration, Instant},
};
use support::{Outcome, headless_log, loading_error, rgb_image, run_with_options, scene_path};

fn main() -> ExitCode {
    run_with_options("composite", USAGE, Options::from_command_line(), composite)
}

/// Longest wait for the scene's assets.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Largest number of frames, after the shaders have loaded, until the ball is unwrapped.
const MAX_MEASURING_FRAMES: u32 = 8;
/// Half the edge of the square around the marker on which there are planar shadows, in meters.
const DESK_HALF_EDGE: f32 = 1.0;
/// Width of the dumped environment in pixels.
const ENVIRONMENT_WIDTH: u32 = 1024;

fn composite(options: &Options) -> Outcome<()> {
    let mut steps = Stopwatch::default();
    let started = Instant::now();
    let frame = FramePixels::open(&options.frame)?;
    steps.note("decode", started.elapsed());
    authoring::read_scene_components(&options.scene)?;
    let intrinsics = options.intrinsics_of(frame.size);
    if let Some(problem) = intrinsics.problem(frame.size) {
        return Err(format!("--intrinsics or --calibration: {problem}").into());
    }

    let started = Instant::now();
    let mut app = build_app(options)?;
    let frame = fit_device(&app, frame);
    let size = frame.size;
    let (picture, target) = headless::add_target(&mut app, size);
    // An active camera would render every frame while the scene loads.
    let camera = Camera { is_active: false, ..default() };
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::new(intrinsics), camera, target, feed)).id();
    if let Some(seed) = options.grain_seed {
        app.world_mut().entity_mut(camera).insert(CameraGrain { seed, ..default() });
    }
    steps.note("start_renderer", started.elapsed());

    let started = Instant::now();
    load_scene(&mut app, &options.scene)?;
    complete_scene(&mut app, options);
    steps.note("load_scene", started.elapsed());

    let started = Instant::now();
    app.update();
    steps.note("first_update", started.elapsed());
    check_marker_and_ball(&mut app, options)?;

    let started = Instant::now();
    let environment = wait_for_environment(&mut app)?;
    steps.note("measure_environment", started.elapsed());

    if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
        camera.is_active = true;
    }
    let started = Instant::now();
    headless::settle(&mut app)?;
    steps.note("warm_up_frames", started.elapsed());
    let started = Instant::now();
    let pixels = headless::read_texture(&mut app, &picture)?;
    steps.note("render_and_read_back", started.elapsed());
    let picture = rgb_image(size, &pixels)?;
    let compared = options.compare.as_deref().map(|path| report::difference(&picture, path)).transpose()?;
    picture.save(&options.out).map_err(|error| format!("cannot write {}: {error}", options.out.display()))?;

    if let Some(path) = &options.dump_environment {
        dump_environment(&mut app, &environment, path)?;
    }
    if let Some(path) = &options.report {
        let text = serde_json::to_string_pretty(&report::report(&mut app, steps, compared))?;
        std::fs::write(path, text).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    }
    Ok(())
}

fn build_app(options: &Options) -> Outcome<App> {
    let folder = options.scene.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let assets = AssetPlugin {
        file_path: std::path::absolute(folder)?.to_string_lossy().into_owned(),
        unapproved_path_mode: UnapprovedPathMode::Deny,
        ..default()
    };
    Ok(headless::build_app(headless::default_plugins().set(assets), |app| {
        app.add_plugins((headless_log(), RenderDiagnosticsPlugin, MirrorballPlugins));
        let max_probes = if options.has_neighbors { NeighborReflections::default().max_probes } else { 0 };
        app.insert_resource(NeighborReflections { max_probes, faces_per_frame: 6, ..default() });
    })?)
}

/// Scales a photograph down that the device cannot hold, and says so.
fn fit_device(app: &App, frame: FramePixels) -> FramePixels {
    let before = frame.size;
    let Some(max_edge) = headless::max_texture_edge(app).filter(|max_edge| before.max_element() > *max_edge) else {
        return frame;
    };
    let frame = frame.limited_to(max_edge);
    eprintln!(
        "composite: the photograph has {} × {} pixels, and the textures of this device end at {max_edge}; it is composited at \
         {} × {}",
        before.x, before.y, frame.size.x, frame.size.y
    );
    frame
}

fn load_scene(app: &mut App, path: &Path) -> Outcome<()> {
    let assets = app.world().resource::<AssetServer>().clone();
    let scene = assets.load(scene_path(path).ok_or("--scene names no file")?);
    app.world_mut().spawn(WorldAssetRoot(scene.clone()));
    let mut failed = None;
    let loaded = headless::update_until(app, "loading the scene", MAX_WAIT, |app| {
        failed = failed.take().or_else(|| loading_error(&assets, &scene, path));
        let world = app.world_mut();
        let has_spawned = world.query::<&Mesh3d>().iter(world).next().is_some()
            || world.query::<&MarkerAnchor>().iter(world).next().is_some();
        failed.is_some() || has_spawned && assets.is_loaded_with_dependencies(&scene)
    });
    match (failed, loaded) {
        (Some(reason), _) => Err(reason.into()),
        (None, Err(HeadlessError::TooLate(..))) => {
            Err(format!("{} did not load within {MAX_WAIT:?} or is empty", path.display()).into())
        }
        (None, loaded) => Ok(loaded?),
    }
}

/// Applies the options to the scene, and adds a dome if it has none.
fn complete_scene(app: &mut App, options: &Options) {
    let world = app.world_mut();
    let domes: Vec<Entity> = world.query_filtered::<Entity, With<ShadowDomeLight>>().iter(world).collect();
    if options.shadows != Shadows::Dome {
        for dome in domes {
            world.entity_mut(dome).remove::<ShadowDomeLight>();
        }
    } else if domes.is_empty() {
        world.spawn(ShadowDomeLight::default());
    }
    if let Shadows::Planar { samples, ambient } = options.shadows {
        // The plane of the marker, which is where the world has its origin.
        let half_size = Vec2::splat(DESK_HALF_EDGE);
        world.spawn(PlanarShadow { half_size, samples, ambient, resolution: 1024, ..default() });
    }
    if !options.has_bounces {
        world.query::<&mut ShadowDomeLight>().iter_mut(world).for_each(|mut dome| dome.surfels = 0);
    }
    let probes: Vec<Entity> = world.query_filtered::<Entity, With<LightProbeSphere>>().iter(world).collect();
    for probe in probes {
        let mut probe = world.entity_mut(probe);
        if options.has_uniform_sky {
            probe.insert(UniformSky::default());
        }
        if let Some(mut recovery) = probe.get_mut::<ClipRecovery>() {
            recovery.is_enabled = options.evidence.is_some();
            recovery.evidence = options.evidence.unwrap_or(recovery.evidence);
        }
    }
}

fn check_marker_and_ball(app: &mut App, options: &Options) -> Outcome<()> {
    let world = app.world_mut();
    let anchors: Vec<(String, bool)> = world
        .query::<(&MarkerAnchor, &MarkerTracking)>()
        .iter(world)
        .map(|(anchor, tracking)| (anchor.marker().to_string(), tracking.state == MarkerState::Tracked))
        .collect();
    let (scene, frame) = (options.scene.display(), options.frame.display());
    if anchors.is_empty() {
        return Err(format!("{scene} has no MarkerAnchor: give a node the extras {{\"MarkerAnchor\": {{\"id\": 0, \"size\": 0.1}}, \"WorldOrigin\": {{}}}}").into());
    }
    if !anchors.iter().any(|(_, is_tracked)| *is_tracked) {
        let markers: Vec<_> = anchors.iter().map(|(marker, _)| &**marker).collect();
        let is_mirrored = world.query::<&DetectedMarkers>().iter(world).any(|detected| !detected.mirrored.is_empty());
        if is_mirrored {
            return Err(format!(
                "no marker: {} is only in the mirror image of {frame}. The picture is mirrored, as selfies are; \
                 flip it horizontally, or switch the camera's mirroring off",
                markers.join(" or ")
            )
            .into());
        }
        return Err(format!(
            "no marker: {} was not found in {frame}. It has to be wholly in the picture, at least 40 pixels \
             wide, sharp, with a white margin, and evenly lit",
            markers.join(" or ")
        )
        .into());
    }
    if world.query_filtered::<(), (With<MarkerAnchor>, With<WorldOrigin>)>().iter(world).next().is_none() {
        eprintln!(
            "composite: no MarkerAnchor of {scene} has WorldOrigin: only what is below an anchor follows the marker"
        );
    }
    let probes: Vec<bool> = world.query::<&ProbeMeasurement>().iter(world).map(|probe| probe.is_in_view).collect();
    if probes.is_empty() {
        return Err(format!("{scene} has no LightProbeSphere: give the node at the ball's center the extras {{\"LightProbeSphere\": {{\"radius\": 0.05}}}}").into());
    }
    if !probes.contains(&true) {
        return Err(format!(
            "no ball: by the marker's pose the ball of {scene} lies outside {frame} or is too small in it. Check the node's \
             position (meters, in the marker's frame), the marker's size and --intrinsics"
        )
        .into());
    }
    Ok(())
}

/// Updates until the ball is unwrapped, and returns the environment. Shaders load in the background.
fn wait_for_environment(app: &mut App) -> Outcome<CubePixels> {
    let world = app.world_mut();
    let cube = world.query::<&EnvironmentCube>().iter(world).next().ok_or("there is no environment")?.0.clone();
    headless::settle(app)?;
    for _ in 0..MAX_MEASURING_FRAMES {
        let bytes = headless::read_texture(app, &cube)?;
        let pixels =
            CubePixels::from_rgba16f(EnvironmentCube::SIZE, &bytes).ok_or("the cube came back in the wrong size")?;
        if pixels.texels.iter().any(|radiance| *radiance != Vec3::ZERO) {
            return Ok(pixels);
        }
    }
    Err("the ball is black in the photograph: there is no light to measure".into())
}

fn dump_environment(app: &mut App, environment: &CubePixels, path: &Path) -> Outcome<()> {
    let world = app.world_mut();
    let world_from_marker = world
        .query_filtered::<&GlobalTransform, With<MarkerAnchor>>()
        .iter(world)
        .next()
        .map_or(Quat::IDENTITY, GlobalTransform::rotation);
    Ok(environment.to_equirect(ENVIRONMENT_WIDTH, world_from_marker).save(path)?)
}
