//! Runs the solver on new pictures, in the background.

use super::{
    ClipGains, SelfCheck,
    bracketing::SeenExposures,
    solver::{
        DeskPicture, FoundLight, MirrorBall, Paper, PhantomSolid, SolvedLight, SolverCache, self_check, solve_light,
        unsolved_light,
    },
};
use crate::{
    camera::{ArCamera, CameraFeed, CameraFrame, FeedPace},
    phantom::{PhantomObject, StageRole},
    probe::{ClipEvidence, ClipRecovery, LightProbeSphere, ProbeMeasurement},
    tracking::{MarkerAnchor, MarkerTracking},
};
use bevy::{
    math::Affine3A,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, TaskPool, block_on, futures::check_ready},
};
use std::{
    sync::Arc,
    time::{Duration, Instant},
};

/// The light of the newest picture that has been worked on; on the entity of its [`LightProbeSphere`]. Absent as long as there was
/// no picture with the ball in it.
#[derive(Component, Clone, Debug)]
pub struct RecoveredLight {
    /// Sequence number of the picture.
    pub sequence: u64,
    /// What was found.
    pub light: Arc<SolvedLight>,
    /// Whether the desk told how bright clipped light is. Otherwise the paper did, or nothing: [`ClipRecovery`] says what may, and
    /// the picture has to show a marker and phantoms.
    pub is_solved: bool,
    /// The lights in it, strongest first.
    pub lights: Vec<FoundLight>,
    /// Time the solver took, in the background.
    pub cpu_time: Duration,
}

/// The phantoms in world space.
#[derive(Resource, Default)]
pub(super) struct DeskSolids {
    solids: Arc<Vec<PhantomSolid>>,
    made_from: Vec<(AssetId<Mesh>, Affine3A, PhantomObject)>,
}

/// Phantoms may move this far before they count as moved: metres, and as much per metre of turning.
const STILL: f32 = 1e-3;

pub(super) fn collect_phantoms(
    mut desk: ResMut<DeskSolids>,
    meshes: Option<Res<Assets<Mesh>>>,
    phantoms: Query<(&Mesh3d, &GlobalTransform, &StageRole)>,
    balls: Query<(&LightProbeSphere, &GlobalTransform)>,
) {
    let Some(meshes) = meshes else {
        return;
    };
    let mut found = Vec::new();
    for (mesh, transform, role) in &phantoms {
        // Meshes that are still loading are not there yet.
        if let (StageRole::Phantom(phantom), Some(_)) = (role, meshes.get(&mesh.0)) {
            found.push((mesh.0.id(), transform.affine(), *phantom));
        }
    }
    let is_near = |a: &Affine3A, b: &Affine3A| a.abs_diff_eq(*b, STILL);
    let is_current = found.len() == desk.made_from.len()
        && found.iter().zip(&desk.made_from).all(|(a, b)| a.0 == b.0 && a.2 == b.2 && is_near(&a.1, &b.1));
    if is_current {
        return;
    }
    let is_ball = |solid: &PhantomSolid| {
        balls.iter().any(|(ball, transform)| solid.is_within(transform.translation(), PROXY_SIZE * ball.radius))
    };
    let solids = found.iter().filter_map(|(mesh, transform, phantom)| {
        let mut solid = PhantomSolid::from_mesh(meshes.get(*mesh)?, transform).filter(|solid| !is_ball(solid))?;
        (solid.casts, solid.receives) = (phantom.casts, phantom.receives);
        solid.reflectance = phantom.reflectance.filter(|reflectance| {
            let is_valid = reflectance.cmpgt(Vec3::ZERO).all() && reflectance.cmple(Vec3::ONE).all();
            if !is_valid {
                warn!("PhantomObject.reflectance is {reflectance}, which is ignored; each channel has to be above 0 and at most 1");
            }
            is_valid
        });
        Some(solid)
    });
    desk.solids = Arc::new(solids.collect());
    desk.made_from = found;
}

/// What a solution was made for.
#[derive(Clone, PartialEq)]
struct Occasion {
    sequence: u64,
    solids: usize,
    probe: LightProbeSphere,
    others: Vec<MirrorBall>,
    recovery: ClipRecovery,
    center: Vec3,
    gain: Vec3,
    exposures: Vec<f32>,
}

struct Answer {
    light: Option<SolvedLight>,
    is_solved: bool,
    lights: Vec<FoundLight>,
    check: Option<(f32, Option<f32>)>,
    cache: SolverCache,
    sequence: u64,
    cpu_time: Duration,
}

/// The solver's state on the entity of a probe.
#[derive(Component, Default)]
pub(super) struct Solver {
    running: Option<Task<Answer>>,
    cache: Option<SolverCache>,
    asked: Option<Occasion>,
}

/// Below this number of points beside the paper's, one gain from the paper is as good.
const LEAST_POINTS: usize = 20;
/// A desk that is explained worse than this is not the desk that the phantoms describe.
const MOST_RESIDUAL: f32 = 0.2;
/// A stand-in for the ball fits into a sphere this many times as wide.
const PROXY_SIZE: f32 = 1.1;

type SolvedProbe = (
    Entity,
    &'static LightProbeSphere,
    &'static ClipRecovery,
    &'static GlobalTransform,
    &'static ProbeMeasurement,
    Option<(&'static mut Solver, &'static SeenExposures)>,
    Has<ClipGains>,
    Option<&'static RecoveredLight>,
);

type FramedCamera = (&'static ArCamera, &'static CameraFrame, &'static GlobalTransform, Option<&'static CameraFeed>);

pub(super) fn recover_lights(
    mut commands: Commands,
    mut probes: Query<SolvedProbe>,
    cameras: Query<FramedCamera>,
    anchors: Query<(&MarkerAnchor, &MarkerTracking)>,
    desk: Res<DeskSolids>,
) {
    let balls: Vec<(Entity, MirrorBall, u64)> = probes
        .iter()
        .filter(|(_, _, _, _, measurement, ..)| measurement.is_in_view)
        .map(|(entity, probe, _, transform, measurement, ..)| (entity, ball(probe, transform), measurement.sequence))
        .collect();
    for (entity, probe, recovery, transform, measurement, solver, has_gains, recovered) in &mut probes {
        // A dark ball is a second exposure of another one.
        if probe.is_dark() {
            continue;
        }
        let Some((mut solver, seen)) = solver else {
            commands.entity(entity).insert((Solver::default(), SeenExposures::default()));
            continue;
        };
        if let Some(answer) = solver.running.as_mut().and_then(check_ready) {
            solver.running = None;
            publish(&mut commands, entity, &mut solver, answer);
        }
        let Some((ar_camera, frame, camera_transform, feed)) = cameras.iter().next() else {
            continue;
        };
        if !measurement.is_in_view || measurement.sequence != frame.sequence || solver.running.is_some() {
            continue;
        }
        let others: Vec<MirrorBall> = balls
            .iter()
            .filter(|(other, _, sequence)| *other != entity && *sequence == frame.sequence)
            .map(|(_, ball, _)| *ball)
            .collect();
        let shorter_exposures = seen.exposures(transform);
        let occasion = Occasion {
            others: others.clone(),
            sequence: frame.sequence,
            solids: Arc::as_ptr(&desk.solids).addr(),
            probe: *probe,
            recovery: *recovery,
            center: transform.translation(),
            gain: measurement.gain,
            exposures: shorter_exposures.iter().map(|shorter| shorter.exposure).collect(),
        };
        if solver.asked.as_ref() == Some(&occasion) {
            continue;
        }
        let world_from_camera = camera_transform.affine();
        let papers: Vec<Paper> = anchors
            .iter()
            .filter(|(_, tracking)| tracking.last_seen == Some(frame.sequence))
            .filter_map(|(anchor, tracking)| {
                Some(Paper {
                    world_from_marker: world_from_camera * Affine3A::from(tracking.camera_from_marker?),
                    size: anchor.size,
                    reflectance: recovery.paper_reflectance,
                })
            })
            .collect();
        // Without the marker nothing is known of the desk: the last answer stays.
        let is_wanted = recovery.is_enabled && recovery.evidence == ClipEvidence::Desk;
        if is_wanted && papers.is_empty() && has_gains {
            continue;
        }
        let up_world =
            papers.first().map_or(Vec3::Y, |p| p.world_from_marker.transform_vector3(Vec3::Y).normalize_or_zero());
        let gain = measurement.gain;
        let shown = recovered.map(|recovered| (recovered.light.clone(), recovered.lights.first().copied()));
        let picture = DeskPicture {
            frame: frame.pixels.clone(),
            intrinsics: ar_camera.intrinsics_for(frame),
            camera_from_world: world_from_camera.inverse(),
            ball: ball(probe, transform),
            other_balls: others,
            shorter_exposures,
            papers,
            phantoms: desk.solids.clone(),
            max_gain: recovery.max_gain,
        };
        solver.asked = Some(occasion);
        let sequence = frame.sequence;
        let mut cache = solver.cache.take().unwrap_or_default();
        let solve = async move {
            let started = Instant::now();
            let check = shown.and_then(|(light, key)| self_check::check(&picture, &light, key.as_ref()));
            let solved = if is_wanted { solve_light(&picture, &mut cache).filter(is_trusted) } else { None };
            let is_solved = solved.is_some();
            let light = solved.or_else(|| unsolved_light(&picture, gain, up_world));
            let lights = light.as_ref().map(|light| picture.lights(light)).unwrap_or_default();
            Answer { light, is_solved, lights, check, cache, sequence, cpu_time: started.elapsed() }
        };
        if feed.is_some_and(|feed| feed.pace() == FeedPace::Lockstep) {
            let answer = block_on(solve);
            publish(&mut commands, entity, &mut solver, answer);
        } else {
            solver.running = Some(AsyncComputeTaskPool::get_or_init(TaskPool::default).spawn(solve));
        }
    }
}

fn ball(probe: &LightProbeSphere, transform: &GlobalTransform) -> MirrorBall {
    MirrorBall {
        center: transform.translation(),
        radius: probe.radius,
        reflectance: probe.reflectance.clamp(0.01, 1.0),
        surface: probe.surface,
    }
}

fn publish(commands: &mut Commands, entity: Entity, solver: &mut Solver, answer: Answer) {
    solver.cache = Some(answer.cache);
    let Answer { is_solved, sequence, lights, cpu_time, .. } = answer;
    let mut entity = commands.entity(entity);
    if let Some((rmse, key_light_angle)) = answer.check {
        entity.insert(SelfCheck { sequence, rmse, key_light_angle });
    }
    let Some(light) = answer.light else {
        return;
    };
    if is_solved {
        entity.insert(ClipGains(Arc::new(light.gains.iter().map(|gain| gain.extend(1.0)).collect())));
    } else {
        entity.remove::<ClipGains>();
    }
    entity.insert(RecoveredLight { sequence, light: Arc::new(light), is_solved, lights, cpu_time });
}

/// Whether enough of the desk was seen and explained, or a darker view shows the lamps.
fn is_trusted(light: &SolvedLight) -> bool {
    let is_desk_seen = light.points >= light.paper_points + LEAST_POINTS && light.residual <= MOST_RESIDUAL;
    is_desk_seen || light.dark_readings > light.regions.len() / 2
}
