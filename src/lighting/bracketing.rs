//! Exposure bracketing: estimates where the ball was in the underexposed frames between those that are shown.

use super::solver::BracketedExposure;
use crate::{
    camera::{ArCamera, BracketedFrame, BracketedFrames, CameraFrame},
    probe::{LightProbeSphere, ProbeMeasurement},
};
use bevy::{ecs::entity::EntityHashSet, math::Affine3A, prelude::*};
use std::time::Duration;

/// Largest age of a bracketed frame. Older ones are ignored, because the lighting may have changed. A webcam takes its
/// whole bracket within this time.
const MAX_AGE: Duration = Duration::from_secs(5);

/// Bracketed frames around the newest frame of a probe, with their poses; on the probe's entity.
#[derive(Component, Default)]
pub(super) struct BracketedPoses {
    /// Camera of the frames.
    camera: Option<Entity>,
    newest: Option<ShownFrame>,
    frames: Vec<BracketedPose>,
}

/// Pose of the ball in a frame that was shown.
#[derive(Clone, Copy)]
struct ShownFrame {
    sequence: u64,
    captured: Duration,
    camera_from_probe: Isometry3d,
}

struct BracketedPose {
    frame: BracketedFrame,
    /// Interpolated between the shown frames before and after it; `None` until the next shown frame arrives.
    camera_from_probe: Option<Isometry3d>,
}

type BracketingCamera = (&'static CameraFrame, &'static GlobalTransform, Option<&'static BracketedFrames>);
type BracketedProbe =
    (&'static LightProbeSphere, &'static GlobalTransform, &'static ProbeMeasurement, &'static mut BracketedPoses);

/// Warns once of each camera whose bracketed frames are of no use, because another camera measures the balls.
pub(super) fn warn_of_unused_brackets(
    cameras: Query<Entity, (With<ArCamera>, Changed<BracketedFrames>)>,
    probes: Query<&ProbeMeasurement>,
    mut warned: Local<EntityHashSet>,
) {
    for camera in &cameras {
        let mut measuring = probes.iter().filter_map(ProbeMeasurement::camera).peekable();
        if let Some(other) = measuring.peek().copied()
            && measuring.all(|of| of != camera)
            && warned.insert(camera)
        {
            warn!(
                "camera {camera}: its shorter exposures are not used, because camera {other} measures the ball. Bracket the \
                 exposures of that one"
            );
        }
    }
}

/// Estimates the pose of the ball in bracketed frames, in which markers are not detected.
pub(super) fn estimate_bracketed_poses(
    cameras: Query<BracketingCamera, With<ArCamera>>,
    mut probes: Query<BracketedProbe>,
) {
    for (probe, transform, measurement, mut poses) in &mut probes {
        let Some(entity) = measurement.camera().filter(|_| !probe.is_dark()) else {
            continue;
        };
        let Ok((frame, camera, shorter)) = cameras.get(entity) else {
            continue;
        };
        if poses.camera.replace(entity).is_some_and(|last| last != entity) {
            *poses = BracketedPoses { camera: Some(entity), ..default() };
        }
        for new in shorter.iter().flat_map(|shorter| shorter.iter()) {
            poses.add(new);
        }
        let is_new = poses.newest.is_none_or(|newest| newest.sequence != frame.sequence);
        if is_new && measurement.is_of(entity, frame.sequence) {
            let camera_from_probe = camera.to_isometry().inverse() * transform.to_isometry();
            poses.interpolate(ShownFrame { sequence: frame.sequence, captured: frame.captured, camera_from_probe });
        }
    }
}

impl BracketedPoses {
    fn add(&mut self, new: &BracketedFrame) {
        let is_known = |pose: &BracketedPose| pose.frame.captured == new.captured && pose.frame.is_same_exposure(new);
        if !self.frames.iter().any(is_known) {
            // Of the frames of one exposure that still wait for the next shown frame, only the newest is kept.
            self.frames.retain(|pose| pose.camera_from_probe.is_some() || !pose.frame.is_same_exposure(new));
            self.frames.push(BracketedPose { frame: new.clone(), camera_from_probe: None });
        }
    }

    /// Interpolates the poses of frames captured before a shown frame, and drops outdated frames.
    fn interpolate(&mut self, shown: ShownFrame) {
        let before = self.newest.replace(shown);
        for pose in self.frames.iter_mut().filter(|pose| pose.frame.captured <= shown.captured) {
            pose.camera_from_probe.get_or_insert_with(|| interpolated_pose(before, shown, pose.frame.captured));
        }
        self.frames.retain(|pose| pose.frame.captured.abs_diff(shown.captured) <= MAX_AGE);
        let posed: Vec<BracketedFrame> =
            self.frames.iter().filter(|pose| pose.camera_from_probe.is_some()).map(|pose| pose.frame.clone()).collect();
        self.frames.retain(|BracketedPose { frame, .. }| {
            !posed.iter().any(|newer| newer.captured > frame.captured && newer.is_same_exposure(frame))
        });
    }

    /// Bracketed exposures for the solver, with poses relative to the current pose of the probe.
    pub(super) fn exposures(&self, world_from_probe: &GlobalTransform) -> Vec<BracketedExposure> {
        let probe_from_world = world_from_probe.to_isometry().inverse();
        let exposure = |pose: &BracketedPose| {
            let camera_from_world = Affine3A::from(pose.camera_from_probe? * probe_from_world);
            let BracketedFrame { pixels, exposure, .. } = pose.frame.clone();
            Some(BracketedExposure { frame: pixels, exposure, camera_from_world: Some(camera_from_world) })
        };
        self.frames.iter().filter_map(exposure).collect()
    }
}

/// Pose of the ball at a time between two frames, by linear interpolation.
fn interpolated_pose(before: Option<ShownFrame>, after: ShownFrame, at: Duration) -> Isometry3d {
    let Some(before) = before.filter(|before| before.captured < after.captured) else {
        return after.camera_from_probe;
    };
    let whole = (after.captured - before.captured).as_secs_f32();
    let t = (at.saturating_sub(before.captured).as_secs_f32() / whole).clamp(0.0, 1.0);
    let (a, b) = (before.camera_from_probe, after.camera_from_probe);
    Isometry3d::new(a.translation.lerp(b.translation, t), a.rotation.slerp(b.rotation, t))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::FramePixels;
    use std::sync::Arc;

    fn frame(exposure: f32, milliseconds: u64) -> BracketedFrame {
        let pixels = Arc::new(FramePixels::new(UVec2::ONE, vec![0; 4]).expect("fits"));
        BracketedFrame { pixels, exposure, captured: Duration::from_millis(milliseconds) }
    }

    fn shown(sequence: u64, milliseconds: u64, x: f32) -> ShownFrame {
        let camera_from_probe = Isometry3d::from_xyz(x, 0.0, -1.0);
        ShownFrame { sequence, captured: Duration::from_millis(milliseconds), camera_from_probe }
    }

    /// Exposures whose pose is known, with the x of the pose.
    fn posed(poses: &BracketedPoses) -> Vec<(f32, f32)> {
        let exposures = poses.exposures(&GlobalTransform::IDENTITY);
        exposures.iter().map(|e| (e.exposure, e.camera_from_world.expect("posed").translation.x)).collect()
    }

    #[test]
    fn a_moving_ball_was_between_its_poses_in_the_frames_before_and_after() {
        let mut poses = BracketedPoses::default();
        poses.interpolate(shown(1, 100, 0.0));
        poses.add(&frame(0.25, 150));
        poses.add(&frame(0.1, 350));
        assert_eq!(posed(&poses), [], "its pose is not known yet");
        poses.interpolate(shown(2, 300, 0.4));
        let [(exposure, x)] = posed(&poses)[..] else { panic!("{:?}", posed(&poses)) };
        assert!(exposure == 0.25 && (x - 0.1).abs() < 1e-6, "a quarter of the way");
        poses.interpolate(shown(3, 400, 0.6));
        assert!((posed(&poses)[1].1 - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_newest_of_each_exposure_is_used_until_it_is_old() {
        let mut poses = BracketedPoses::default();
        for at in [0, 100, 200] {
            poses.add(&frame(0.25, at));
            poses.interpolate(shown(at, at + 50, 0.001 * at as f32));
        }
        assert_eq!(posed(&poses).len(), 1);
        poses.add(&frame(0.25, 200));
        assert_eq!(poses.frames.len(), 1, "the same once more");
        let end = 200 + MAX_AGE.as_millis() as u64;
        poses.interpolate(shown(4, end, 0.0));
        assert_eq!(posed(&poses).len(), 1);
        poses.interpolate(shown(5, end + 1, 0.0));
        assert_eq!(posed(&poses), []);
    }
}
