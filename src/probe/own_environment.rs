//! Environments of cameras beside the one that measures the balls.
//!
//! Two cameras seldom agree on exposure and white balance, so the environment that one of them measures has the wrong
//! units in the frames of the other. A further camera that has a ball in view therefore gets an environment of its own,
//! made from its own frames. Light that it clips is recovered from the marker's paper alone.

use super::{
    ball_view::BallView,
    clip_recovery::ClipRecovery,
    history::HistoryHint,
    light_probe_sphere::{LightProbeSphere, UniformSky},
    observer::{Observer, Observing},
    probe_measurement::{ProbeMeasurement, ProbeView},
    solids::{Solid, Surroundings, solids_of},
};
use crate::{environment_map::EnvironmentCube, phantom::StageRole};
use bevy::{camera::primitives::Aabb, prelude::*};
use std::sync::Arc;

/// Environment in the units of one camera, on the entity of the camera.
#[derive(Component, Clone, Debug)]
pub(crate) struct OwnEnvironment {
    pub cube: EnvironmentCube,
    pub views: Vec<OwnView>,
    updates: u32,
}

/// Newest view of a ball in the frames of a camera.
#[derive(Clone, Debug)]
pub(crate) struct OwnView {
    pub probe: Entity,
    pub sequence: u64,
    pub view: ProbeView,
    pub hint: HistoryHint,
}

/// Updates after which the cube has certainly been written.
const WRITTEN_AFTER: u32 = 4;

impl OwnEnvironment {
    /// Whether the cube shows what the camera sees.
    pub(crate) fn is_written(&self) -> bool {
        self.updates >= WRITTEN_AFTER
    }
}

type OwnProbe = (
    Entity,
    &'static LightProbeSphere,
    &'static ClipRecovery,
    &'static GlobalTransform,
    Option<&'static UniformSky>,
    &'static ProbeMeasurement,
);

/// Measures balls in the frames of cameras other than the one that has measured them already.
pub(super) fn measure_own_views(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    probes: Query<OwnProbe>,
    mut environments: Query<&mut OwnEnvironment>,
    observing: Observing,
    phantoms: Query<(&StageRole, &Aabb, &GlobalTransform)>,
) {
    let observers = observing.observers();
    if observers.len() < 2 && environments.is_empty() {
        return;
    }
    let is_any_posed = observers.iter().any(|observer| observer.is_posed);
    let solids = solids_of(phantoms.iter());
    for observer in observers.iter().filter(|observer| observer.is_posed == is_any_posed) {
        let mut environment = environments.get_mut(observer.camera).ok();
        if let Some(environment) = &mut environment {
            environment.updates = environment.updates.saturating_add(1);
        }
        let shares = |measurement: &ProbeMeasurement| {
            environment.is_none() && measurement.camera().is_none_or(|camera| camera == observer.camera)
        };
        let own: Vec<_> =
            probes.iter().filter(|(_, probe, .., measurement)| !probe.is_dark() && !shares(measurement)).collect();
        let last = |probe| environment.as_ref()?.views.iter().find(|view| view.probe == probe);
        let new: Vec<OwnView> =
            own.into_iter().filter_map(|ball| observer.own_view(ball, last(ball.0), &solids)).collect();
        if new.is_empty() {
            continue;
        }
        match environment {
            Some(mut environment) => {
                environment.views.retain(|view| new.iter().all(|new| new.probe != view.probe));
                environment.views.extend(new);
            }
            None => {
                let cube = EnvironmentCube::allocate(&mut images);
                commands.entity(observer.camera).insert(OwnEnvironment { cube, views: new, updates: 0 });
            }
        }
    }
}

type OwnBall<'a> =
    (Entity, &'a LightProbeSphere, &'a ClipRecovery, &'a GlobalTransform, Option<&'a UniformSky>, &'a ProbeMeasurement);

impl Observer<'_> {
    /// View of a ball in the frame; `None` if the ball is out of view or nothing has changed since the last view.
    fn own_view(
        &self,
        (probe, sphere, clip_recovery, place, sky, _): OwnBall<'_>,
        last: Option<&OwnView>,
        solids: &[Solid],
    ) -> Option<OwnView> {
        let camera_from_world = self.posed.camera_from_world;
        let center = place.translation();
        let center_camera = camera_from_world.transform_point3(center);
        let surroundings = Surroundings::new(solids, &camera_from_world, center, sphere.radius);
        let last_gain = last.map_or(Vec3::ONE, |last| last.view.gain);
        let is_same_frame = last.is_some_and(|last| last.sequence == self.frame.sequence);
        if is_same_frame && last.is_some_and(|last| last.is_of(center_camera, sphere, sky, &surroundings)) {
            return None;
        }
        let (mut measured, clipped_ball) = self.measure(sphere, clip_recovery, center_camera, sky, last_gain);
        if let Some(clipped_ball) = clipped_ball {
            measured.set_clipping(&clipped_ball.measure());
        }
        let view = measured.view?;
        let ball = BallView::new(center_camera, sphere.radius)?;
        let before = last.map(|last| last.hint.clone()).unwrap_or_default();
        let hint = before.updated(&self.posed, self.frame.captured, &ball, view.edge_angle, &Arc::new(surroundings));
        Some(OwnView { probe, sequence: self.frame.sequence, view, hint })
    }
}

impl OwnView {
    fn is_of(
        &self,
        center_camera: Vec3,
        sphere: &LightProbeSphere,
        sky: Option<&UniformSky>,
        surroundings: &Surroundings,
    ) -> bool {
        let ProbeView { radius, reflectance, uniform_radiance, .. } = self.view;
        self.view.center_camera == center_camera
            && (radius, reflectance) == (sphere.radius, sphere.reflectance.clamp(0.01, 1.0))
            && uniform_radiance.is_some() == sky.is_some()
            && *surroundings == *self.hint.surroundings
    }
}
