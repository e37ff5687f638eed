//! The stage rendered to files, one image per frame of the feed, or per step of the dance in a place without one.

use crate::{
    Outcome, Show,
    dancer::Dance,
    game::{Choice, Screen},
    options::Options,
    platform, result_file,
    support::{fits_device, headless_log, loading_error, rgb_image},
    view::View,
};
use bevy::{
    animation::AnimationPlugin, diagnostic::DiagnosticsStore, prelude::*, render::diagnostic::RenderDiagnosticsPlugin,
    sprite::SpritePlugin, sprite_render::SpriteRenderPlugin, state::app::StatesPlugin, text::TextPlugin,
    time::TimeUpdateStrategy, ui::UiPlugin, ui_render::UiRenderPlugin,
};
use bevy_mirrorball::{
    camera::FeedStatistics,
    debug::{CheckLevel, Checklist},
    headless,
    prelude::*,
    probe::ProbeMeasurement,
    tracking::MarkerTracking,
};
use image::{Rgb, RgbImage, imageops};
use serde_json::{Value, json};
use std::{
    path::Path,
    time::{Duration, Instant},
};

/// Number of frames rendered before the first image counts, in which Bevy prepares materials and pipelines.
const WARM_UP_FRAMES: u32 = 2;
/// Longest wait for the scene, and for the first frame and its light.
const MAX_WAIT: Duration = Duration::from_secs(60);
/// Time step of the dance from image to image.
const STEP: Duration = Duration::from_nanos(1_000_000_000 / 15);
/// Width of an image in the contact sheet in pixels, and images per row.
const THUMBNAIL_WIDTH: u32 = 160;
const SHEET_COLUMNS: u32 = 10;
const EMPTY_CELL: Rgb<u8> = Rgb([32; 3]);

pub(crate) fn run(options: &Options) -> Outcome<()> {
    std::fs::create_dir_all(&options.out)
        .map_err(|error| format!("cannot make the folder {}: {error}", options.out.display()))?;
    let view = View::open(options, FeedPace::Lockstep)?;
    let plugins = headless::default_plugins().set(platform::asset_plugin(options)?);
    // Pictures show the arrows at once.
    let usual = Choice { lead_in: 1.0, plays_intro: false, ..default() };
    let show = Show::open(options, options.choice(usual))?;
    let mut scene = Handle::default();
    let mut app = headless::build_app(plugins, |app| {
        app.add_plugins((headless_log(), RenderDiagnosticsPlugin, MirrorballPlugins));
        // What the figure and the game need beside what pictures do.
        app.add_plugins((
            AnimationPlugin,
            StatesPlugin,
            SpritePlugin,
            SpriteRenderPlugin,
            TextPlugin,
            UiPlugin,
            UiRenderPlugin,
        ));
        scene = show.build(app);
    })?;
    let size = options.size.unwrap_or(view.size());
    fits_device(&app, size)?;
    let (picture, target) = headless::add_target(&mut app, size);
    wait_for_scene(&mut app, &scene, &view, options)?;
    let camera = view.spawn_camera(app.world_mut());
    app.world_mut().entity_mut(camera).insert(target);
    // The title is a window's.
    app.world_mut().resource_mut::<NextState<Screen>>().set(Screen::Rehearsal);
    warm_up(&mut app, &view)?;

    // The recording starts with the first frame of the feed and the first beat.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(STEP)).insert_resource(Dance::default());
    if options.is_demo {
        app.world_mut().resource_mut::<NextState<Screen>>().set(Screen::Dance);
    }
    view.restart(app.world_mut());
    let mut sheet = ContactSheet::new(size, options.frames);
    let mut lines = Vec::new();
    let mut failure = None;
    let started = Instant::now();
    headless::record(
        &mut app,
        &picture,
        options.frames,
        |app, frame| lines.push(report_line(app, frame)),
        |frame, bytes| {
            let saved = save(size, &bytes, &options.out.join(format!("frame_{frame:04}.png")));
            match saved {
                Ok(picture) => sheet.add(frame, &picture),
                Err(error) => failure = Some(error),
            }
        },
    )?;
    let seconds = started.elapsed().as_secs_f64();
    if let Some(error) = failure {
        return Err(error);
    }
    sheet.save(&options.out.join("contact_sheet.png"))?;
    if let Some(file) = &options.result {
        result_file::write(&mut app, file)?;
    }
    let path = options.out.join("report.json");
    let report = json!({ "frames": lines, "seconds": seconds, "milliseconds": timings(&app) });
    std::fs::write(&path, serde_json::to_string_pretty(&report)?)
        .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    println!("dance_stage: {} pictures in {seconds:.1} s, see {}", options.frames, options.out.display());
    match view {
        View::Desk(_) => print_checklist(&mut app),
        // The checklist is that of a camera.
        View::Place(..) => Ok(()),
    }
}

fn wait_for_scene(app: &mut App, scene: &Handle<WorldAsset>, view: &View, options: &Options) -> Outcome<()> {
    let assets = app.world().resource::<AssetServer>().clone();
    let file = options.scene_file();
    let started = Instant::now();
    while started.elapsed() < MAX_WAIT {
        headless::update(app)?;
        if let Some(error) = loading_error(&assets, scene, &file) {
            return Err(error.into());
        }
        if view.has_scene(app.world_mut()) && assets.is_loaded_with_dependencies(scene) {
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    Err(format!("{} did not load in time, or {}", file.display(), view.lack()).into())
}

/// Updates until there is a picture and its light. Shaders load in the background.
fn warm_up(app: &mut App, view: &View) -> Outcome<()> {
    let started = Instant::now();
    while started.elapsed() < MAX_WAIT {
        headless::update(app)?;
        if view.is_lit(app)? {
            for _ in 0..WARM_UP_FRAMES {
                headless::update(app)?;
            }
            return Ok(());
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Err("no picture arrived, or it gave no light".into())
}

fn report_line(app: &mut App, frame: u32) -> Value {
    let world = app.world_mut();
    let tracking = world.query::<&MarkerTracking>().iter(world).next().cloned().unwrap_or_default();
    let probe = world.query::<&ProbeMeasurement>().iter(world).next().cloned().unwrap_or_default();
    let statistics = world.query::<&FeedStatistics>().iter(world).next().cloned().unwrap_or_default();
    if world.query::<&ArCamera>().iter(world).next().is_none() {
        return json!({ "frame": frame, "memory_mib": resident_memory() });
    }
    let rows = tracking
        .camera_from_marker
        .map(|pose| Mat4::from(bevy::math::Affine3A::from(pose)).transpose().to_cols_array());
    json!({
        "frame": frame,
        "picture": statistics.frames,
        "dropped": statistics.dropped,
        "marker": format!("{:?}", tracking.state),
        "camera_from_marker": rows,
        "ball_in_view": probe.is_in_view,
        "clipped_share": probe.clipped_fraction,
        "gain": probe.gain.to_array(),
        "memory_mib": resident_memory(),
    })
}

/// Smoothed time of each stage and of each GPU pass.
fn timings(app: &App) -> Value {
    let diagnostics = app.world().get_resource::<DiagnosticsStore>().into_iter().flat_map(DiagnosticsStore::iter);
    let named = diagnostics.filter_map(|diagnostic| {
        let path = diagnostic.path().as_str();
        let is_time = path.starts_with("mirrorball/") || path.ends_with("/elapsed_gpu");
        Some((path.to_owned(), json!(diagnostic.smoothed().filter(|_| is_time)?)))
    });
    Value::Object(named.collect())
}

/// Resident memory of this process in MiB, if the system reports it.
fn resident_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok().map(|kib| kib / 1024.0)
}

fn save(size: UVec2, rgba: &[u8], path: &Path) -> Outcome<RgbImage> {
    let picture = rgb_image(size, rgba)?;
    picture.save(path).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(picture)
}

/// Contact sheet: thumbnails of all images, in rows.
struct ContactSheet {
    thumbnail: UVec2,
    sheet: RgbImage,
}

impl ContactSheet {
    fn new(size: UVec2, frames: u32) -> Self {
        let thumbnail = UVec2::new(THUMBNAIL_WIDTH, (THUMBNAIL_WIDTH * size.y / size.x).max(1));
        let (columns, rows) = (frames.min(SHEET_COLUMNS), frames.div_ceil(SHEET_COLUMNS));
        let sheet = RgbImage::from_pixel(columns * thumbnail.x, rows * thumbnail.y, EMPTY_CELL);
        Self { thumbnail, sheet }
    }

    fn add(&mut self, frame: u32, picture: &RgbImage) {
        let small = imageops::thumbnail(picture, self.thumbnail.x, self.thumbnail.y);
        let at = UVec2::new(frame % SHEET_COLUMNS, frame / SHEET_COLUMNS) * self.thumbnail;
        imageops::replace(&mut self.sheet, &small, at.x.into(), at.y.into());
    }

    fn save(&self, path: &Path) -> Outcome<()> {
        Ok(self.sheet.save(path).map_err(|error| format!("cannot write {}: {error}", path.display()))?)
    }
}

/// Prints all items of the checklist that are not good.
fn print_checklist(app: &mut App) -> Outcome<()> {
    let world = app.world_mut();
    let checks =
        world.run_system_cached(|checklist: Checklist| checklist.checks()).map_err(|error| error.to_string())?;
    for check in checks.iter().filter(|check| check.level != CheckLevel::Good) {
        println!("dance_stage: {}: {}", check.topic, check.text);
    }
    Ok(())
}
