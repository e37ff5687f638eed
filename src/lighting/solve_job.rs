//! Inputs, key, job and result of solving one frame.

use super::solver::{
    BracketedExposure, DeskFrame, DetectedLight, MirrorBall, Paper, PhantomSolid, SolvedLight, SolverCache, self_check,
    solve_light, unsolved_light,
};
use crate::{
    camera::{ArCamera, CameraFrame},
    probe::{ClipRecovery, LightProbeSphere, ProbeMeasurement},
};
use bevy::{math::Affine3A, platform::time::Instant, prelude::*};
use std::{sync::Arc, time::Duration};

/// State of the world that a solution depends on, apart from the markers and the camera's pose.
pub(super) struct SolveInputs<'a> {
    pub(super) sphere: &'a LightProbeSphere,
    pub(super) recovery: &'a ClipRecovery,
    pub(super) transform: &'a GlobalTransform,
    pub(super) measurement: &'a ProbeMeasurement,
    pub(super) camera: Entity,
    pub(super) frame: &'a CameraFrame,
    pub(super) other_balls: Vec<MirrorBall>,
    pub(super) bracketed_exposures: Vec<BracketedExposure>,
    pub(super) solids: &'a Arc<Vec<PhantomSolid>>,
}

/// Inputs of a solution. While they stay the same, the frame is not solved again.
#[derive(Clone, PartialEq)]
pub(super) struct SolveKey {
    camera: Entity,
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

impl SolveInputs<'_> {
    /// Key that identifies these inputs.
    pub(super) fn key(&self) -> SolveKey {
        SolveKey {
            camera: self.camera,
            sequence: self.frame.sequence,
            solids: Arc::as_ptr(self.solids).addr(),
            probe: *self.sphere,
            others: self.other_balls.clone(),
            recovery: *self.recovery,
            center: self.transform.translation(),
            gain: self.measurement.gain,
            exposures: self.bracketed_exposures.iter().map(|bracketed| bracketed.exposure).collect(),
        }
    }

    /// Input of the solver.
    pub(super) fn into_desk_frame(
        self,
        camera: &ArCamera,
        world_from_camera: Affine3A,
        papers: Vec<Paper>,
    ) -> DeskFrame {
        DeskFrame {
            frame: self.frame.pixels.clone(),
            intrinsics: camera.intrinsics_for(self.frame),
            camera_from_world: world_from_camera.inverse(),
            ball: mirror_ball(self.sphere, self.transform),
            other_balls: self.other_balls,
            bracketed_exposures: self.bracketed_exposures,
            papers,
            phantoms: self.solids.clone(),
            max_gain: self.recovery.max_gain,
        }
    }
}

/// The ball of a probe, for the solver.
pub(super) fn mirror_ball(probe: &LightProbeSphere, transform: &GlobalTransform) -> MirrorBall {
    MirrorBall {
        center: transform.translation(),
        radius: probe.radius,
        reflectance: probe.reflectance.clamp(0.01, 1.0),
        surface: probe.surface,
    }
}

/// Everything that a background task needs to solve one frame.
pub(super) struct SolveJob {
    pub(super) sequence: u64,
    pub(super) desk: DeskFrame,
    /// Whether clipped light is to be recovered from the desk.
    pub(super) is_wanted: bool,
    /// Gain by the paper, for frames that are not solved.
    pub(super) gain: Vec3,
    pub(super) up_world: Vec3,
    /// Light that is on display, with its strongest light.
    pub(super) shown: Option<(Arc<SolvedLight>, Option<DetectedLight>)>,
    pub(super) cache: SolverCache,
}

/// Output of a [`SolveJob`].
pub(super) struct SolveResult {
    pub(super) sequence: u64,
    pub(super) light: Option<SolvedLight>,
    pub(super) is_solved: bool,
    pub(super) lights: Vec<DetectedLight>,
    pub(super) check: Option<(f32, Option<f32>)>,
    pub(super) cache: SolverCache,
    pub(super) cpu_time: Duration,
}

/// Fewest points on phantoms for a solution to be trusted. With fewer, one gain from the paper is as good.
const MIN_PHANTOM_POINTS: usize = 20;
/// Largest residual of a trusted solution. Above it, the phantoms do not describe the real desk.
const MAX_RESIDUAL: f32 = 0.2;

impl SolveJob {
    /// Solves the frame.
    pub(super) fn run(self) -> SolveResult {
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

/// Whether a solution rests on enough of the desk and explains it, or darker views show most of the clipped lights.
fn is_trusted(light: &SolvedLight) -> bool {
    let is_desk_seen = light.points >= light.paper_points + MIN_PHANTOM_POINTS && light.residual <= MAX_RESIDUAL;
    is_desk_seen || light.bracketed_regions > light.regions.len() / 2
}
