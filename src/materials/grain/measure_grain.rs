//! Measurement of the noise and the sharpness of a camera's frames, now and then.

use super::{
    CameraGrain,
    edge_width::edge_width,
    noise_bands::{BINS, Variances, measure_noise},
    noise_tile::OCTAVES,
};
use crate::{
    camera::{CameraFeed, CameraFrame, FeedPace, FramePixels},
    frame_tasks::spawn_for_frame,
    tracking::DetectedMarkers,
};
use bevy::{
    math::DVec2,
    prelude::*,
    tasks::{Task, futures::check_ready},
};
use std::{sync::Arc, time::Duration};

/// Time of the frames between two measurements.
const INTERVAL: Duration = Duration::from_secs(1);
/// Weight of a new measurement beside those before.
const NEWEST: f32 = 0.3;

/// Noise and sharpness of the frames of a camera, as measured; beside a [`CameraGrain`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::materials::GrainMeasurement;
/// fn print(cameras: Query<&GrainMeasurement>) {
///     for camera in &cameras {
///         println!("noise of middle gray: {}, edges: {:?} pixels", camera.noise(0.5), camera.edge_width);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct GrainMeasurement {
    /// Standard deviation of the blur of edges in the frame, in pixels of the frame, that of the pixels' own area,
    /// 0.29, included. `None` until a large, unclipped marker was seen.
    pub edge_width: Option<f32>,
    /// By octave and brightness, in squared steps of the 8-bit sRGB frame: red, green, blue, luma.
    variances: Option<[[Vec4; BINS]; OCTAVES]>,
    /// Time of capture of the newest frame that was measured.
    measured: Option<Duration>,
}

impl GrainMeasurement {
    /// Standard deviation of the noise of red, green and blue, sRGB-encoded and relative to white, where the frame has
    /// a brightness: luma of the encoded frame, 0…1 (clamped). Zero until it was measured.
    pub fn noise(&self, brightness: f32) -> Vec3 {
        let place = (brightness * BINS as f32 - 0.5).clamp(0.0, (BINS - 1) as f32);
        let (bin, next) = (place as usize, (place as usize + 1).min(BINS - 1));
        let octave = |octave: &[Vec4; BINS]| octave[bin].lerp(octave[next], place.fract());
        let variance: Vec4 = self.variances.iter().flatten().map(octave).sum();
        variance.truncate().map(f32::sqrt) / 255.0
    }

    /// Variances by octave and brightness.
    pub(super) fn variances(&self) -> Option<&Variances> {
        self.variances.as_ref()
    }

    fn add(&mut self, found: Found) {
        self.measured = Some(found.captured);
        self.edge_width = match (self.edge_width, found.edge_width) {
            (Some(old), Some(new)) => Some(old + NEWEST * (new - old)),
            (old, new) => new.or(old),
        };
        match (&mut self.variances, found.variances) {
            (Some(old), Some(new)) => {
                for (old, new) in old.iter_mut().flatten().zip(new.into_iter().flatten()) {
                    *old = old.lerp(new, NEWEST);
                }
            }
            (old, new) => *old = new.or(*old),
        }
    }

    /// Whether a frame is to be measured. Clips start over, and then their times do.
    fn is_due(&self, captured: Duration) -> bool {
        self.measured.is_none_or(|last| captured < last || captured >= last + INTERVAL)
    }
}

/// What one frame shows.
struct Found {
    captured: Duration,
    variances: Option<Variances>,
    edge_width: Option<f32>,
}

impl Found {
    fn in_frame(pixels: &FramePixels, captured: Duration, marker: Option<[DVec2; 4]>) -> Self {
        let edge_width = marker.and_then(|corners| edge_width(pixels, &corners));
        Self { captured, variances: measure_noise(pixels), edge_width }
    }
}

#[derive(Component)]
pub(super) struct RunningMeasurement(Task<Found>);

type MeasuredCamera = (
    Entity,
    Ref<'static, CameraFrame>,
    &'static mut GrainMeasurement,
    Option<&'static CameraFeed>,
    Option<&'static DetectedMarkers>,
    Option<&'static mut RunningMeasurement>,
);

pub(super) fn measure_grain(mut commands: Commands, mut cameras: Query<MeasuredCamera, With<CameraGrain>>) {
    for (camera, frame, mut measurement, feed, markers, running) in &mut cameras {
        if let Some(mut running) = running {
            if let Some(found) = check_ready(&mut running.0) {
                measurement.add(found);
                commands.entity(camera).remove::<RunningMeasurement>();
            }
            continue;
        }
        let is_new = frame.is_changed() || measurement.measured.is_none();
        if !is_new || !measurement.is_due(frame.captured) {
            continue;
        }
        let (pixels, captured) = (Arc::clone(&frame.pixels), frame.captured);
        let marker = markers.filter(|markers| markers.sequence == frame.sequence).and_then(largest_marker);
        let measure = move || Found::in_frame(&pixels, captured, marker);
        if feed.is_some_and(|feed| feed.pace() == FeedPace::Lockstep) {
            measurement.add(measure());
        } else {
            commands.entity(camera).insert(RunningMeasurement(spawn_for_frame(async move { measure() })));
        }
    }
}

/// Corners of the marker with the longest diagonal.
fn largest_marker(markers: &DetectedMarkers) -> Option<[DVec2; 4]> {
    let diagonal = |corners: &[DVec2; 4]| corners[0].distance_squared(corners[2]);
    let corners = markers.markers.iter().map(|marker| marker.corners);
    corners.max_by(|a, b| diagonal(a).total_cmp(&diagonal(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_are_smoothed_and_missing_ones_change_nothing() {
        let found = |seconds: u64, variance: Option<f32>, edge_width: Option<f32>| Found {
            captured: Duration::from_secs(seconds),
            variances: variance.map(|variance| [[Vec4::splat(variance); BINS]; OCTAVES]),
            edge_width,
        };
        let mut measurement = GrainMeasurement::default();
        assert!(measurement.is_due(Duration::ZERO) && measurement.noise(0.5) == Vec3::ZERO);
        measurement.add(found(5, Some(3.0), None));
        assert!((measurement.noise(0.5) - 3.0 / 255.0).abs().max_element() < 1e-6, "of three octaves");
        measurement.add(found(6, None, Some(1.0)));
        measurement.add(found(7, Some(13.0), Some(2.0)));
        assert!((measurement.noise(1.0) - 18.0_f32.sqrt() / 255.0).abs().max_element() < 1e-6);
        assert!(measurement.edge_width.is_some_and(|width| (width - 1.3).abs() < 1e-6));
        assert!(!measurement.is_due(Duration::from_millis(7900)));
        assert!(measurement.is_due(Duration::from_secs(8)) && measurement.is_due(Duration::from_secs(1)));
    }
}
