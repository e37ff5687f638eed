//! The report of measurements and times, as JSON.

use bevy::{
    diagnostic::DiagnosticsStore,
    math::Affine3A,
    prelude::*,
    render::renderer::{RenderAdapterInfo, RenderDevice},
};
use bevy_mirrorball::{
    debug::device_memory,
    probe::ProbeMeasurement,
    tracking::{DetectedMarkers, MarkerTracking},
};
use image::RgbImage;
use serde_json::{Map, Value, json};
use std::{path::Path, time::Duration};

/// Milliseconds of each step of this program.
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

/// Compares an image with one in a file, in steps of 255.
pub(crate) fn difference(picture: &RgbImage, path: &Path) -> Result<Value, String> {
    let other = image::open(path).map_err(|error| format!("cannot read {}: {error}", path.display()))?.to_rgb8();
    if other.dimensions() != picture.dimensions() {
        return Err(format!(
            "--compare: {} has {:?} pixels, the result {:?}",
            path.display(),
            other.dimensions(),
            picture.dimensions()
        ));
    }
    let steps: Vec<u8> = picture.as_raw().iter().zip(other.as_raw()).map(|(a, b)| a.abs_diff(*b)).collect();
    let pixels = picture.width() * picture.height();
    let near = steps.chunks_exact(3).filter(|pixel| pixel.iter().all(|step| *step <= 6)).count();
    Ok(json!({
        "mean": steps.iter().copied().map(f64::from).sum::<f64>() / f64::from(3 * pixels),
        "largest": steps.iter().max(),
        "within_6_percent": 100.0 * near as f64 / f64::from(pixels),
    }))
}

/// Returns all results as one JSON object.
pub(crate) fn report(app: &mut App, mut steps: Stopwatch, compared: Option<Value>) -> Value {
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
    let device = world.get_resource::<RenderAdapterInfo>();
    let memory: Map<String, Value> = world
        .get_resource::<RenderDevice>()
        .and_then(device_memory)
        .into_iter()
        .flatten()
        .map(|part| (part.label, json!(part.bytes)))
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
            "clipped_share": probe.clipped_fraction,
        },
        "paper": probe.paper.map(|paper| paper.to_array()),
        "gains": probe.gain.to_array(),
        "milliseconds": steps.0,
        "milliseconds_gpu": passes,
        "device": device.map(|info| format!("{}, {} {}", info.name, info.driver, info.driver_info)),
        "device_bytes": memory,
        "compared": compared,
    })
}
