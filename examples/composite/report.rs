//! What was found out on the way, as JSON.

use bevy::{diagnostic::DiagnosticsStore, math::Affine3A, prelude::*};
use bevy_mirrorball::{
    probe::ProbeMeasurement,
    tracking::{DetectedMarkers, MarkerTracking},
};
use serde_json::{Map, Value, json};
use std::time::Duration;

/// Milliseconds of the steps this program takes itself.
#[derive(Default)]
pub(crate) struct Stopwatch(Map<String, Value>);

impl Stopwatch {
    pub(crate) fn note(&mut self, step: &str, time: Duration) {
        self.0.insert(step.to_owned(), json!(milliseconds(time)));
    }
}

fn milliseconds(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e6).round() / 1e3
}

/// Everything the app knows, as one JSON object.
pub(crate) fn report(app: &mut App, mut steps: Stopwatch) -> Value {
    let world = app.world_mut();
    let tracking = world.query::<&MarkerTracking>().iter(world).find(|t| t.camera_from_marker.is_some()).cloned();
    let probe = world.query::<&ProbeMeasurement>().iter(world).next().cloned().unwrap_or_default();
    let detected = world.query::<&DetectedMarkers>().iter(world).next().map(|detected| detected.cpu_time);
    steps.note("detect_markers", detected.unwrap_or_default());
    steps.note("measure_probe", probe.cpu_time);
    let passes: Map<String, Value> = world
        .get_resource::<DiagnosticsStore>()
        .into_iter()
        .flat_map(DiagnosticsStore::iter)
        .filter_map(|diagnostic| {
            let path = diagnostic.path().as_str();
            let pass = path.strip_prefix("render/")?.strip_suffix("/elapsed_gpu")?;
            Some((pass.to_owned(), json!(diagnostic.value()?)))
        })
        .collect();
    let rows = tracking.as_ref().and_then(|t| t.camera_from_marker).map(|pose| {
        let m = Mat4::from(Affine3A::from(pose)).transpose();
        m.to_cols_array()
    });
    json!({
        "camera_from_marker": rows,
        "reprojection_error_px": tracking.as_ref().map(|t| t.reprojection_error),
        "ball": {
            "center_px": probe.outline.center.to_array(),
            "semi_axes_px": probe.outline.semi_axes.to_array(),
            "angle_degrees": probe.outline.angle.to_degrees(),
            "clipped_share": probe.clipped_share,
        },
        "paper": probe.paper.map(|paper| paper.to_array()),
        "gains": probe.gain.to_array(),
        "milliseconds": steps.0,
        "milliseconds_gpu": passes,
    })
}
