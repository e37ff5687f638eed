//! Measurement of mirrored balls in the frames of the AR camera, once per new frame or pose.

use super::{
    ball_view::{BallView, EDGE_MARGIN_PIXELS},
    clip_recovery::{ClipRecovery, PaperAndBall},
    clipping::is_clipped,
    ellipse::Ellipse,
    history::HistoryHint,
    light_probe_sphere::{LightProbeSphere, UniformSky},
    paper::paper_radiance,
    probe_measurement::{ProbeMeasurement, ProbeView},
    solids::{Surroundings, solids_of},
};
use crate::{
    camera::{ArCamera, CameraFrame, FramePixels, Intrinsics, PosedFrame, camera_rank, world_from_camera},
    phantom::StageRole,
    tracking::SeenMarker,
};
use bevy::{camera::primitives::Aabb, math::Affine3A, prelude::*};
use std::{sync::Arc, time::Instant};

/// Fraction of the box around a ball's outline that must be inside the frame for the ball to be in view.
const MIN_VISIBLE_FRACTION: f32 = 0.33;
/// Fraction of that box from which the gain of clipped light is measured; below it, the last gain is kept.
const MIN_VISIBLE_FRACTION_FOR_GAIN: f32 = 0.9;
/// Radius in the frame from which a ball is usable, in pixels.
const MIN_RADIUS_PIXELS: f32 = 6.0;

type ProbeItem = (
    Ref<'static, LightProbeSphere>,
    Ref<'static, ClipRecovery>,
    &'static GlobalTransform,
    Option<Ref<'static, UniformSky>>,
    &'static mut ProbeMeasurement,
    &'static mut HistoryHint,
);

type MeasuringCamera = (Entity, &'static Camera, &'static ArCamera, &'static CameraFrame, &'static GlobalTransform);

pub(super) fn measure_probes(
    mut probes: Query<ProbeItem>,
    cameras: Query<MeasuringCamera>,
    markers: Query<SeenMarker>,
    phantoms: Query<(&StageRole, &Aabb, &GlobalTransform)>,
) {
    let mut sorted: Vec<_> = cameras.iter().collect();
    // A camera that has not seen a marker yet is anywhere.
    let is_posed = |camera| markers.iter().any(|marker| marker.is_known_to(camera));
    sorted.sort_by_key(|(entity, camera, ..)| (!is_posed(*entity), camera_rank(*entity, camera)));
    let observers: Vec<Observer> = sorted
        .iter()
        .map(|(camera, _, ar_camera, frame, place)| Observer {
            camera: *camera,
            is_posed: is_posed(*camera),
            frame,
            posed: PosedFrame {
                frame: &frame.pixels,
                intrinsics: ar_camera.intrinsics_for(frame),
                camera_from_world: world_from_camera(place).inverse(),
                exposure: 1.0,
            },
            seen_marker: markers
                .iter()
                .find_map(|marker| Some((marker.pose_in(*camera, frame.sequence)?, marker.size()))),
        })
        .collect();
    let marker_changed = markers.iter().any(|marker| marker.is_changed());
    let solids = solids_of(phantoms.iter());
    for (probe, clip_recovery, transform, uniform_sky, mut measurement, mut hint) in &mut probes {
        let center = transform.translation();
        let last_camera = measurement.view.map(|view| view.camera);
        let Some(observer) = choose_observer(&observers, last_camera, center, probe.radius) else {
            return;
        };
        let Observer { camera, frame, posed, .. } = *observer;
        let PosedFrame { intrinsics, camera_from_world, .. } = posed;
        let center_camera = camera_from_world.transform_point3(center);
        let surroundings = Surroundings::new(&solids, &camera_from_world, center, probe.radius);
        // While the ball is out of view, its last view is kept. It must not count as the present one when the ball
        // returns.
        let unchanged = measurement.sequence == frame.sequence
            && measurement.is_in_view
            && !marker_changed
            && surroundings == *hint.surroundings
            && !probe.is_changed()
            && !clip_recovery.is_changed()
            && !uniform_sky.as_ref().is_some_and(|sky| sky.is_changed())
            && measurement.view.is_some_and(|view| {
                view.camera == camera
                    && view.center_camera == center_camera
                    && view.camera_from_world == Mat3::from(camera_from_world.matrix3)
                    && view.focal == intrinsics.focal
                    && view.center == intrinsics.center
                    && view.uniform_radiance.is_some() == uniform_sky.is_some()
            });
        if unchanged {
            continue;
        }
        let started = Instant::now();
        let mut measured =
            observer.measure(&probe, &clip_recovery, center_camera, uniform_sky.as_deref(), measurement.gain);
        if let (true, Some(view), Some(ball)) =
            (measured.is_in_view, &measured.view, BallView::new(center_camera, probe.radius))
        {
            // Two cameras may have different exposures: their frames are not compared.
            let before = if last_camera == Some(camera) { std::mem::take(&mut *hint) } else { HistoryHint::default() };
            *hint = before.updated(&posed, frame.captured, &ball, view.edge_angle, &Arc::new(surroundings));
            measured.seen_fraction = hint.seen_fraction;
        }
        let measured = ProbeMeasurement {
            sequence: frame.sequence,
            cpu_time: started.elapsed(),
            // A ball out of view is a valid state: the environment keeps what was seen last.
            view: measured.view.or(measurement.view),
            ..measured
        };
        let is_changed = *measurement != ProbeMeasurement { cpu_time: measurement.cpu_time, ..measured.clone() };
        if is_changed {
            *measurement = measured;
        }
    }
}

/// A frame in which balls can be measured, and the marker seen in it: its pose in camera space and its size in meters.
struct Observer<'a> {
    camera: Entity,
    /// Whether the camera has seen a marker.
    is_posed: bool,
    frame: &'a CameraFrame,
    posed: PosedFrame<'a>,
    seen_marker: Option<(Affine3A, f32)>,
}

/// Chooses the camera that measures a ball: one that has seen a marker and has the ball in view, and of several the
/// one that has measured it so far, so that the light does not change back and forth between two exposures.
fn choose_observer<'a>(
    observers: &'a [Observer<'a>],
    last_camera: Option<Entity>,
    center: Vec3,
    radius: f32,
) -> Option<&'a Observer<'a>> {
    let is_in_view = |observer: &Observer| {
        let PosedFrame { frame, intrinsics, camera_from_world, .. } = observer.posed;
        BallView::new(camera_from_world.transform_point3(center), radius)
            .is_some_and(|ball| is_usable(&ball, &ball.outline(&intrinsics), &intrinsics, frame.size))
    };
    observers
        .iter()
        .min_by_key(|observer| (!is_in_view(observer), !observer.is_posed, Some(observer.camera) != last_camera))
}

/// Whether enough of a ball is in a frame, and large enough.
fn is_usable(ball: &BallView, outline: &Ellipse, intrinsics: &Intrinsics, frame_size: UVec2) -> bool {
    ball.radius_pixels(intrinsics) >= MIN_RADIUS_PIXELS && visible_fraction(outline, frame_size) >= MIN_VISIBLE_FRACTION
}

impl Observer<'_> {
    fn measure(
        &self,
        probe: &LightProbeSphere,
        clip_recovery: &ClipRecovery,
        center_camera: Vec3,
        uniform_sky: Option<&UniformSky>,
        last_gain: Vec3,
    ) -> ProbeMeasurement {
        let mut measured = ProbeMeasurement { gain: Vec3::ONE, ..default() };
        let PosedFrame { frame, intrinsics, camera_from_world, .. } = self.posed;
        let Some(ball) = BallView::new(center_camera, probe.radius) else {
            return measured;
        };
        measured.outline = ball.outline(&intrinsics);
        let visible = visible_fraction(&measured.outline, frame.size);
        measured.is_in_view = is_usable(&ball, &measured.outline, &intrinsics, frame.size);
        if !measured.is_in_view {
            return measured;
        }
        let reflectance = probe.reflectance.clamp(0.01, 1.0);
        measured.clipped_fraction = clipped_fraction(frame, &measured.outline);
        measured.paper = self.seen_marker.and_then(|(pose, size)| paper_radiance(frame, &intrinsics, &pose, size));
        let up_camera = self.seen_marker.map(|(pose, _)| pose.transform_vector3(Vec3::Y).normalize());
        if let (true, Some(paper), Some(up_camera)) = (clip_recovery.is_enabled, measured.paper, up_camera) {
            let view = PaperAndBall { posed: self.posed, ball: &ball, reflectance, normal_camera: up_camera };
            let is_whole = visible >= MIN_VISIBLE_FRACTION_FOR_GAIN;
            measured.gain = if is_whole { view.gain(paper, clip_recovery) } else { last_gain.max(Vec3::ONE) };
        }
        let gray = |paper: Vec3| Vec3::splat(paper.element_sum() / (3.0 * clip_recovery.paper_reflectance));
        measured.view = Some(ProbeView {
            camera: self.camera,
            camera_from_world: camera_from_world.matrix3.into(),
            center_camera,
            radius: probe.radius,
            reflectance,
            edge_angle: ball.edge_angle(&intrinsics, EDGE_MARGIN_PIXELS),
            focal: intrinsics.focal,
            center: intrinsics.center,
            gain: measured.gain,
            up_camera: up_camera.unwrap_or_default(),
            uniform_radiance: uniform_sky.map(|sky| sky.radiance.or(measured.paper.map(gray)).unwrap_or(Vec3::ONE)),
        });
        measured
    }
}

/// Fraction of the box around an outline that lies inside a frame.
fn visible_fraction(outline: &Ellipse, frame_size: UVec2) -> f32 {
    let half = outline.half_extent();
    let low = (outline.center - half).max(Vec2::ZERO);
    let high = (outline.center + half).min(frame_size.as_vec2());
    let inside = (high - low).max(Vec2::ZERO);
    inside.element_product() / (4.0 * half.element_product())
}

/// Fraction of the pixels inside an outline that are clipped.
fn clipped_fraction(frame: &FramePixels, outline: &Ellipse) -> f32 {
    let half = outline.half_extent();
    let low = (outline.center - half).max(Vec2::ZERO).as_ivec2();
    let high = (outline.center + half).min(frame.size.as_vec2() - 1.0).as_ivec2();
    let (mut clipped, mut all) = (0u32, 0u32);
    for y in low.y..=high.y {
        for x in low.x..=high.x {
            if outline.contains(Vec2::new(x as f32 + 0.5, y as f32 + 0.5)) {
                all += 1;
                clipped += u32::from(is_clipped(frame, x, y));
            }
        }
    }
    clipped as f32 / all.max(1) as f32
}
