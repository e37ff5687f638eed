//! Measurement of mirrored balls in the frames of the AR camera, once per new frame or pose.

use super::{
    ball_view::BallView,
    clip_recovery::ClipRecovery,
    history::HistoryHint,
    light_probe_sphere::{LightProbeSphere, UniformSky},
    observer::{Observer, Observing, choose_observer},
    probe_measurement::ProbeMeasurement,
    solids::{Surroundings, solids_of},
};
use crate::{camera::PosedFrame, phantom::StageRole};
use bevy::{camera::primitives::Aabb, platform::time::Instant, prelude::*};
use std::sync::Arc;

type ProbeItem = (
    Ref<'static, LightProbeSphere>,
    Ref<'static, ClipRecovery>,
    &'static GlobalTransform,
    Option<Ref<'static, UniformSky>>,
    &'static mut ProbeMeasurement,
    &'static mut HistoryHint,
);

pub(super) fn measure_probes(
    mut probes: Query<ProbeItem>,
    observing: Observing,
    phantoms: Query<(&StageRole, &Aabb, &GlobalTransform)>,
) {
    let observers = observing.observers();
    let marker_changed = observing.is_marker_changed();
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
