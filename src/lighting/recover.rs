//! Runs the solver on new frames, in the background.

use super::{
    bracketing::BracketedPoses,
    clip_gains::ClipGains,
    desk_solids::DeskSolids,
    solve_job::{SolveInputs, SolveJob, SolveKey, SolveResult, mirror_ball},
    solver::{DetectedLight, MirrorBall, Paper, SolvedLight, SolverCache, self_check::SelfCheck},
};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace, world_from_camera},
    probe::{ClipEvidence, ClipRecovery, LightProbeSphere, ProbeMeasurement},
    tracking::SeenMarker,
};
use bevy::{
    ecs::query::QueryData,
    math::Affine3A,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};
use std::{sync::Arc, time::Duration};

/// Light of the newest frame that has been solved, on the entity of its [`LightProbeSphere`].
///
/// The component is absent until a frame has shown the ball.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::lighting::RecoveredLight;
/// fn watch(recovered: Query<&RecoveredLight, Changed<RecoveredLight>>) {
///     for light in &recovered {
///         info!("frame {}: {} lights, solved {}", light.sequence, light.lights.len(), light.is_solved);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct RecoveredLight {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Radiance of the surroundings with clipped light recovered.
    pub light: Arc<SolvedLight>,
    /// Whether clipped light was recovered from the things on the desk. If `false`, the gain comes from the paper alone
    /// or there is none: [`ClipRecovery`] does not allow more, or the frame shows no marker or too little of the
    /// phantoms.
    pub is_solved: bool,
    /// Detected lights, strongest first.
    pub lights: Vec<DetectedLight>,
    /// Time that the solver took, usually on a background thread.
    pub cpu_time: Duration,
}

/// State of the solver, on the entity of a probe.
#[derive(Component, Default)]
pub(super) struct ProbeSolver {
    running: Option<Task<SolveResult>>,
    cache: Option<SolverCache>,
    /// Inputs of the newest job.
    key: Option<SolveKey>,
}

#[derive(QueryData)]
#[query_data(mutable)]
pub(super) struct SolvedProbe {
    entity: Entity,
    sphere: &'static LightProbeSphere,
    recovery: &'static ClipRecovery,
    transform: &'static GlobalTransform,
    measurement: &'static ProbeMeasurement,
    solver: Option<(&'static mut ProbeSolver, &'static BracketedPoses)>,
    has_gains: Has<ClipGains>,
    recovered: Option<&'static RecoveredLight>,
}

type FramedCamera = (&'static ArCamera, &'static CameraFrame, &'static GlobalTransform, Option<&'static CameraFeed>);

/// Publishes finished solutions and starts the solver on new frames.
pub(super) fn recover_lights(
    mut commands: Commands,
    mut probes: Query<SolvedProbe>,
    cameras: Query<FramedCamera>,
    markers: Query<SeenMarker>,
    desk: Res<DeskSolids>,
) {
    let balls: Vec<(Entity, MirrorBall, ProbeMeasurement)> = probes
        .iter()
        .filter(|probe| probe.measurement.is_in_view)
        .map(|probe| (probe.entity, mirror_ball(probe.sphere, probe.transform), probe.measurement.clone()))
        .collect();
    for SolvedProbeItem { entity, sphere, recovery, transform, measurement, solver, has_gains, recovered } in
        &mut probes
    {
        // A dark ball is a second exposure of another ball.
        if sphere.is_dark() {
            continue;
        }
        let Some((mut solver, brackets)) = solver else {
            commands.entity(entity).insert((ProbeSolver::default(), BracketedPoses::default()));
            continue;
        };
        if let Some(result) = solver.running.as_mut().and_then(check_ready) {
            solver.running = None;
            publish(&mut commands, entity, &mut solver, result);
        }
        let Some(camera) = measurement.camera() else {
            continue;
        };
        let Ok((ar_camera, frame, camera_transform, feed)) = cameras.get(camera) else {
            continue;
        };
        if !measurement.is_of(camera, frame.sequence) || solver.running.is_some() {
            continue;
        }
        let is_other = |(other, _, measurement): &&(Entity, _, ProbeMeasurement)| {
            *other != entity && measurement.is_of(camera, frame.sequence)
        };
        let other_balls: Vec<MirrorBall> = balls.iter().filter(is_other).map(|(_, ball, _)| *ball).collect();
        let inputs = SolveInputs {
            sphere,
            recovery,
            transform,
            measurement,
            camera,
            frame,
            other_balls,
            bracketed_exposures: brackets.exposures(transform),
            solids: &desk.solids,
        };
        let key = inputs.key();
        if solver.key.as_ref() == Some(&key) {
            continue;
        }
        let world_from_camera = world_from_camera(camera_transform);
        let papers = papers_in(camera, frame.sequence, &markers, world_from_camera, recovery.paper_reflectance);
        // Without a marker nothing is known of the desk: the last solution stays.
        let is_wanted = recovery.is_enabled && recovery.evidence == ClipEvidence::Desk;
        if is_wanted && papers.is_empty() && has_gains {
            continue;
        }
        let up = |paper: &Paper| paper.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero();
        let job = SolveJob {
            sequence: frame.sequence,
            is_wanted,
            gain: measurement.gain,
            up_world: papers.first().map_or(Vec3::Y, up),
            shown: recovered.map(|recovered| (recovered.light.clone(), recovered.lights.first().copied())),
            desk: inputs.into_desk_frame(ar_camera, world_from_camera, papers),
            cache: solver.cache.take().unwrap_or_default(),
        };
        solver.key = Some(key);
        if feed.is_some_and(|feed| feed.pace() == FeedPace::Lockstep) {
            publish(&mut commands, entity, &mut solver, job.run());
        } else {
            let task = async move { job.run() };
            solver.running = Some(AsyncComputeTaskPool::get_or_init(TaskPool::default).spawn(task));
        }
    }
}

/// Sheets of the markers that were detected in a frame of a camera.
fn papers_in(
    camera: Entity,
    sequence: u64,
    markers: &Query<SeenMarker>,
    world_from_camera: Affine3A,
    reflectance: f32,
) -> Vec<Paper> {
    markers
        .iter()
        .filter_map(|marker| {
            let (camera_from_marker, size) = marker.paper_in(camera, sequence)?;
            Some(Paper { world_from_marker: world_from_camera * camera_from_marker, size, reflectance })
        })
        .collect()
}

fn publish(commands: &mut Commands, entity: Entity, solver: &mut ProbeSolver, result: SolveResult) {
    solver.cache = Some(result.cache);
    let SolveResult { is_solved, sequence, lights, cpu_time, .. } = result;
    let mut entity = commands.entity(entity);
    if let Some((rmse, key_light_angle)) = result.check {
        entity.insert(SelfCheck { sequence, rmse, key_light_angle });
    }
    let Some(light) = result.light else {
        return;
    };
    if is_solved {
        entity.insert(ClipGains::new(&light.gains, light.point_light));
    } else {
        entity.remove::<ClipGains>();
    }
    entity.insert(RecoveredLight { sequence, light: Arc::new(light), is_solved, lights, cpu_time });
}
