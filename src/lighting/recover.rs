//! Runs the solver on new frames, in the background.

use super::{
    ClipGains, SelfCheck,
    bracketing::BracketedPoses,
    desk_solids::DeskSolids,
    solver::{
        DeskFrame, DetectedLight, MirrorBall, Paper, SolvedLight, SolverCache, self_check, solve_light, unsolved_light,
    },
};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace},
    probe::{ClipEvidence, ClipRecovery, LightProbeSphere, ProbeMeasurement},
    tracking::{MarkerAnchor, MarkerTracking},
};
use bevy::{
    ecs::query::QueryData,
    math::Affine3A,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, futures::check_ready},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// Light of the newest frame that has been solved, on the entity of its [`LightProbeSphere`].
///
/// The component is absent until a frame has shown the ball.
#[derive(Component, Clone, Debug)]
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

/// Inputs of a solution. While they stay the same, the frame is not solved again.
#[derive(Clone, PartialEq)]
struct SolveKey {
    sequence: u64,
    /// Address of the list of solids.
    solids: usize,
    probe: LightProbeSphere,
    others: Vec<MirrorBall>,
    recovery: ClipRecovery,
    center: Vec3,
    gain: Vec3,
    exposures: Vec<f32>,
}

/// Everything that a background task needs to solve one frame.
struct SolveJob {
    sequence: u64,
    desk: DeskFrame,
    /// Whether clipped light is to be recovered from the desk.
    is_wanted: bool,
    /// Gain by the paper, for frames that are not solved.
    gain: Vec3,
    up_world: Vec3,
    /// Light that is on display, with its strongest light.
    shown: Option<(Arc<SolvedLight>, Option<DetectedLight>)>,
    cache: SolverCache,
}

struct SolveResult {
    sequence: u64,
    light: Option<SolvedLight>,
    is_solved: bool,
    lights: Vec<DetectedLight>,
    check: Option<(f32, Option<f32>)>,
    cache: SolverCache,
    cpu_time: Duration,
}

/// State of the solver, on the entity of a probe.
#[derive(Component, Default)]
pub(super) struct ProbeSolver {
    running: Option<Task<SolveResult>>,
    cache: Option<SolverCache>,
    /// Inputs of the newest job.
    key: Option<SolveKey>,
}

/// Fewest points on phantoms for a solution to be trusted. With fewer, one gain from the paper is as good.
const MIN_PHANTOM_POINTS: usize = 20;
/// Largest residual of a trusted solution. Above it, the phantoms do not describe the real desk.
const MAX_RESIDUAL: f32 = 0.2;

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
    anchors: Query<(&MarkerAnchor, &MarkerTracking)>,
    desk: Res<DeskSolids>,
) {
    let balls: Vec<(Entity, MirrorBall, u64)> = probes
        .iter()
        .filter(|probe| probe.measurement.is_in_view)
        .map(|probe| (probe.entity, mirror_ball(probe.sphere, probe.transform), probe.measurement.sequence))
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
        let Some((ar_camera, frame, camera_transform, feed)) = cameras.iter().next() else {
            continue;
        };
        if !measurement.is_in_view || measurement.sequence != frame.sequence || solver.running.is_some() {
            continue;
        }
        let is_other = |(other, _, sequence): &&(Entity, _, u64)| *other != entity && *sequence == frame.sequence;
        let other_balls: Vec<MirrorBall> = balls.iter().filter(is_other).map(|(_, ball, _)| *ball).collect();
        let bracketed_exposures = brackets.exposures(transform);
        let key = SolveKey {
            sequence: frame.sequence,
            solids: Arc::as_ptr(&desk.solids).addr(),
            probe: *sphere,
            others: other_balls.clone(),
            recovery: *recovery,
            center: transform.translation(),
            gain: measurement.gain,
            exposures: bracketed_exposures.iter().map(|bracketed| bracketed.exposure).collect(),
        };
        if solver.key.as_ref() == Some(&key) {
            continue;
        }
        let world_from_camera = camera_transform.affine();
        let papers = papers_in(frame.sequence, &anchors, world_from_camera, recovery.paper_reflectance);
        // Without a marker nothing is known of the desk: the last solution stays.
        let is_wanted = recovery.is_enabled && recovery.evidence == ClipEvidence::Desk;
        if is_wanted && papers.is_empty() && has_gains {
            continue;
        }
        let job = SolveJob {
            sequence: frame.sequence,
            is_wanted,
            gain: measurement.gain,
            up_world: papers
                .first()
                .map_or(Vec3::Y, |p| p.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero()),
            shown: recovered.map(|recovered| (recovered.light.clone(), recovered.lights.first().copied())),
            desk: DeskFrame {
                frame: frame.pixels.clone(),
                intrinsics: ar_camera.intrinsics_for(frame),
                camera_from_world: world_from_camera.inverse(),
                ball: mirror_ball(sphere, transform),
                other_balls,
                bracketed_exposures,
                papers,
                phantoms: desk.solids.clone(),
                max_gain: recovery.max_gain,
            },
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

fn mirror_ball(probe: &LightProbeSphere, transform: &GlobalTransform) -> MirrorBall {
    MirrorBall {
        center: transform.translation(),
        radius: probe.radius,
        reflectance: probe.reflectance.clamp(0.01, 1.0),
        surface: probe.surface,
    }
}

/// Sheets of the markers that were detected in a frame.
fn papers_in(
    sequence: u64,
    anchors: &Query<(&MarkerAnchor, &MarkerTracking)>,
    world_from_camera: Affine3A,
    reflectance: f32,
) -> Vec<Paper> {
    anchors
        .iter()
        .filter(|(_, tracking)| tracking.last_seen == Some(sequence))
        .filter_map(|(anchor, tracking)| {
            Some(Paper {
                world_from_marker: world_from_camera * Affine3A::from(tracking.camera_from_marker?),
                size: anchor.size,
                reflectance,
            })
        })
        .collect()
}

impl SolveJob {
    fn run(self) -> SolveResult {
        let Self { sequence, desk, is_wanted, gain, up_world, shown, mut cache } = self;
        let started = Instant::now();
        let check = shown.and_then(|(light, key_light)| self_check::compare_ball(&desk, &light, key_light.as_ref()));
        let solved = if is_wanted { solve_light(&desk, &mut cache).filter(is_trusted) } else { None };
        let is_solved = solved.is_some();
        let light = solved.or_else(|| unsolved_light(&desk, gain, up_world));
        let lights = light.as_ref().map(|light| desk.lights(light)).unwrap_or_default();
        SolveResult { sequence, light, is_solved, lights, check, cache, cpu_time: started.elapsed() }
    }
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
        entity.insert(ClipGains(Arc::new(light.gains.iter().map(|gain| gain.extend(1.0)).collect())));
    } else {
        entity.remove::<ClipGains>();
    }
    entity.insert(RecoveredLight { sequence, light: Arc::new(light), is_solved, lights, cpu_time });
}

/// Whether a solution rests on enough of the desk and explains it, or darker views show most of the clipped lights.
fn is_trusted(light: &SolvedLight) -> bool {
    let is_desk_seen = light.points >= light.paper_points + MIN_PHANTOM_POINTS && light.residual <= MAX_RESIDUAL;
    is_desk_seen || light.bracketed_regions > light.regions.len() / 2
}
