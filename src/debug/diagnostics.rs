//! Measurements of the stages as Bevy diagnostics.

use super::main_thread;
use crate::{
    MirrorballSystems,
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace, FeedStatistics, camera_rank},
    lighting::{RecoveredLight, SelfCheck},
    probe::ProbeMeasurement,
    tracking::DetectedMarkers,
};
use bevy::{
    diagnostic::{Diagnostic, DiagnosticPath, Diagnostics, RegisterDiagnostic},
    platform::time::Instant,
    prelude::*,
    render::{Extract, ExtractSchedule, Render, RenderApp, RenderSystems, renderer::RenderQueue},
};
use std::{
    sync::{Arc, Mutex, PoisonError},
    time::Duration,
};

/// Frames per second that the source delivers.
pub const CAPTURE_RATE: DiagnosticPath = DiagnosticPath::const_new("mirrorball/capture_rate");
/// Number of frames that the game never received.
pub const DROPPED: DiagnosticPath = DiagnosticPath::const_new("mirrorball/dropped");
/// Milliseconds to decode a frame.
pub const DECODE: DiagnosticPath = DiagnosticPath::const_new("mirrorball/decode");
/// Milliseconds to detect markers in a frame.
pub const DETECT: DiagnosticPath = DiagnosticPath::const_new("mirrorball/detect");
/// Milliseconds to measure ball and paper.
pub const MEASURE: DiagnosticPath = DiagnosticPath::const_new("mirrorball/measure");
/// Milliseconds to recover clipped light and to detect lights.
pub const RECOVER: DiagnosticPath = DiagnosticPath::const_new("mirrorball/recover");
/// Root mean square difference between a virtual ball and the real one, in percent of the sRGB-encoded range.
pub const BALL_ERROR: DiagnosticPath = DiagnosticPath::const_new("mirrorball/ball_error");
/// Degrees between the strongest light and its image in the real ball.
pub const KEY_LIGHT_ANGLE: DiagnosticPath = DiagnosticPath::const_new("mirrorball/key_light_angle");
/// Milliseconds from the capture of a camera frame until the GPU has finished the render lit by it. Not measured in
/// [lockstep](FeedPace::Lockstep), where camera frames have the time of their recording.
///
/// The end of a render is noticed when the next one is submitted to the GPU, so the value is too long by at most one
/// render.
pub const LIGHTING_AGE: DiagnosticPath = DiagnosticPath::const_new("mirrorball/lighting_age");

/// Milliseconds of an update from the first to the last stage of this crate, in `PreUpdate` and `PostUpdate`. Systems
/// of the game that run beside them on other threads make it longer. Detection, decoding and the recovery of light are
/// not in it for live feeds: they run in the background.
pub const MAIN_THREAD: DiagnosticPath = DiagnosticPath::const_new("mirrorball/main_thread");

/// Registers the diagnostics of this module, and updates them.
pub struct MirrorballDiagnosticsPlugin;

impl Plugin for MirrorballDiagnosticsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        for path in [DECODE, DETECT, MEASURE, RECOVER, LIGHTING_AGE, MAIN_THREAD] {
            app.register_diagnostic(Diagnostic::new(path).with_suffix(" ms"));
        }
        app.register_diagnostic(Diagnostic::new(CAPTURE_RATE).with_suffix(" /s"))
            .register_diagnostic(Diagnostic::new(DROPPED))
            .register_diagnostic(Diagnostic::new(BALL_ERROR).with_suffix(" %"))
            .register_diagnostic(Diagnostic::new(KEY_LIGHT_ANGLE).with_suffix("°"))
            .add_systems(PostUpdate, (record_stages, record_light).after(MirrorballSystems::Light));
        main_thread::build(app);
        let finished = FinishedFrames::default();
        app.insert_resource(finished.clone()).add_systems(First, record_lighting_age);
        if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
            render_app
                .insert_resource(finished)
                .init_resource::<DrawnFrame>()
                .add_systems(ExtractSchedule, extract_drawn_frame)
                .add_systems(Render, watch_submitted_work.in_set(RenderSystems::Cleanup));
        }
    }
}

fn milliseconds(time: Duration) -> f64 {
    1e3 * time.as_secs_f64()
}

type NewFrame = (
    Entity,
    &'static Camera,
    Ref<'static, CameraFrame>,
    Option<&'static FeedStatistics>,
    Option<&'static DetectedMarkers>,
);

fn record_stages(
    mut diagnostics: Diagnostics,
    cameras: Query<NewFrame, With<ArCamera>>,
    probes: Query<&ProbeMeasurement>,
) {
    let first = cameras.iter().min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera));
    let Some((camera, _, frame, statistics, detected)) = first.filter(|(_, _, frame, ..)| frame.is_changed()) else {
        return;
    };
    if let Some(statistics) = statistics {
        diagnostics.add_measurement(&CAPTURE_RATE, || f64::from(statistics.capture_rate));
        diagnostics.add_measurement(&DROPPED, || statistics.dropped as f64);
        diagnostics.add_measurement(&DECODE, || milliseconds(statistics.decode_time));
    }
    if let Some(detected) = detected.filter(|detected| detected.sequence == frame.sequence) {
        diagnostics.add_measurement(&DETECT, || milliseconds(detected.cpu_time));
    }
    let is_of = |probe: &&ProbeMeasurement| {
        probe.sequence == frame.sequence && probe.camera().is_none_or(|measured_by| measured_by == camera)
    };
    if let Some(probe) = probes.iter().find(is_of) {
        diagnostics.add_measurement(&MEASURE, || milliseconds(probe.cpu_time));
    }
}

fn record_light(
    mut diagnostics: Diagnostics,
    recovered: Query<&RecoveredLight, Changed<RecoveredLight>>,
    checks: Query<&SelfCheck, Changed<SelfCheck>>,
) {
    if let Some(light) = recovered.iter().next() {
        diagnostics.add_measurement(&RECOVER, || milliseconds(light.cpu_time));
    }
    if let Some(check) = checks.iter().next() {
        diagnostics.add_measurement(&BALL_ERROR, || f64::from(100.0 * check.rmse));
        if let Some(angle) = check.key_light_angle {
            diagnostics.add_measurement(&KEY_LIGHT_ANGLE, || f64::from(angle.to_degrees()));
        }
    }
}

/// Capture times of camera frames whose renders the GPU has finished, and the times of completion; shared with the
/// render world.
#[derive(Resource, Clone, Default)]
struct FinishedFrames(Arc<Mutex<Vec<(Duration, Instant)>>>);

/// Camera frame that is being drawn.
#[derive(Resource, Default)]
struct DrawnFrame {
    newest: Option<(u64, Duration)>,
    watched: Option<u64>,
}

type LiveCamera = (Entity, &'static Camera, &'static CameraFrame, &'static CameraFeed);

fn extract_drawn_frame(mut drawn: ResMut<DrawnFrame>, cameras: Extract<Query<LiveCamera, With<ArCamera>>>) {
    drawn.newest = cameras
        .iter()
        .min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera))
        .filter(|(.., feed)| feed.pace() == FeedPace::Live)
        .map(|(_, _, frame, _)| (frame.sequence, frame.captured));
}

fn watch_submitted_work(mut drawn: ResMut<DrawnFrame>, finished: Res<FinishedFrames>, queue: Res<RenderQueue>) {
    let Some((sequence, captured)) = drawn.newest.filter(|(sequence, _)| drawn.watched != Some(*sequence)) else {
        return;
    };
    drawn.watched = Some(sequence);
    let finished = finished.0.clone();
    queue.on_submitted_work_done(move || {
        finished.lock().unwrap_or_else(PoisonError::into_inner).push((captured, Instant::now()));
    });
}

fn record_lighting_age(mut diagnostics: Diagnostics, finished: Res<FinishedFrames>, time: Res<Time<Real>>) {
    for (captured, at) in finished.0.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        let age = at.saturating_duration_since(time.startup()).saturating_sub(captured);
        diagnostics.add_measurement(&LIGHTING_AGE, || milliseconds(age));
    }
}
