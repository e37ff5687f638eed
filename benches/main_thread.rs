//! Time that an update takes on the main thread, from the camera's frame to the settings of the shadows, while marker
//! detection and the recovery of light run beside it.
//!
//! `cargo bench --bench main_thread -- --csv main_thread.csv`
//!
//! The recorded desk plays live at 15 frames per second in a game of 60 updates per second without a renderer, so that
//! no software driver takes the processor away. Systems run one after the other on the main thread, so that the time
//! between the first and the last stage is theirs and not that of waking up other threads. The columns are
//! `case,updates,median_ms,p90_ms`: `new frame` are updates in which a frame arrives with its markers, `between` all
//! others.
//!
//! `--seconds N` measures for so long.

use bevy::{
    diagnostic::DiagnosticsStore,
    ecs::schedule::{ScheduleLabel, SingleThreadedExecutor},
    gltf::GltfAssetLabel,
    prelude::*,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
};
use bevy_mirrorball::{debug::MAIN_THREAD, headless, prelude::*, probe::ProbeMeasurement};
use std::{
    fmt::Write,
    path::PathBuf,
    time::{Duration, Instant},
};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Interval between updates.
const INTERVAL: Duration = Duration::from_micros(16_667);
/// Time in which the scene is loaded and the marker found.
const WARM_UP: Duration = Duration::from_secs(3);

struct Options {
    csv: Option<PathBuf>,
    measured: Duration,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, measured: Duration::from_secs(12) };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("seconds") => options.measured = Duration::from_secs(parser.value()?.parse::<u64>()?.max(1)),
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// The recorded desk with its set, as a game has it.
fn desk() -> Outcome<App> {
    let no_renderer = RenderPlugin {
        render_creation: RenderCreation::Automatic(Box::new(WgpuSettings { backends: None, ..default() })),
        ..default()
    };
    let mut app = headless::build_app(headless::default_plugins().set(no_renderer), |app| {
        app.add_plugins(MirrorballPlugins);
    })?;
    for label in [PreUpdate.intern(), PostUpdate.intern()] {
        app.edit_schedule(label, |schedule| {
            schedule.set_executor(SingleThreadedExecutor::new());
        });
    }
    let scene = app.world().resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset("desk/desk.glb"));
    app.world_mut().spawn(WorldAssetRoot(scene));
    let clip = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/desk_clip");
    app.world_mut().spawn((ArCamera::default(), CameraFeed::clip(clip)));
    Ok(app)
}

/// Milliseconds of the newest update.
fn main_thread_ms(app: &App) -> Option<f64> {
    app.world().resource::<DiagnosticsStore>().get(&MAIN_THREAD)?.measurement().map(|measured| measured.value)
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut app = desk()?;
    let mut measurements = app.world_mut().query::<&ProbeMeasurement>();
    let (mut with_frame, mut between) = (Vec::new(), Vec::new());
    let (started, mut last) = (Instant::now(), 0);
    while started.elapsed() < WARM_UP + options.measured {
        let next = Instant::now() + INTERVAL;
        headless::update(&mut app)?;
        let sequence = measurements.iter(app.world()).map(|measurement| measurement.sequence).max().unwrap_or(0);
        if started.elapsed() > WARM_UP {
            let measured = if sequence == last { &mut between } else { &mut with_frame };
            measured.extend(main_thread_ms(&app));
        }
        last = sequence;
        std::thread::sleep(next.saturating_duration_since(Instant::now()));
    }
    if with_frame.is_empty() {
        return Err("the ball was not measured in any frame".into());
    }
    let mut table = "case,updates,median_ms,p90_ms\n".to_owned();
    for (case, times) in [("new frame", &mut with_frame), ("between", &mut between)] {
        times.sort_by(f64::total_cmp);
        let at = |fraction: f64| times.get((fraction * times.len() as f64) as usize).copied().unwrap_or(f64::NAN);
        writeln!(table, "{case},{},{:.3},{:.3}", times.len(), at(0.5), at(0.9))?;
    }
    print!("{table}");
    if let Some(file) = options.csv {
        std::fs::write(&file, table).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    Ok(())
}
