//! Shorter exposures that the camera took between the pictures that are shown → what the solver is told of them.

use super::solver::ShorterExposure;
use crate::{
    camera::{ArCamera, CameraFrame, ShorterFrame, ShorterFrames},
    probe::{LightProbeSphere, ProbeMeasurement},
};
use bevy::{math::Affine3A, prelude::*};
use std::time::Duration;

/// Shorter exposures are told of for so long, for light changes. A webcam's series comes round in this time.
const LONGEST_AGE: Duration = Duration::from_secs(5);

/// The shorter exposures about a probe's newest picture; on its entity.
#[derive(Component, Default)]
pub(super) struct SeenExposures {
    newest: Option<SeenPicture>,
    frames: Vec<SeenExposure>,
}

/// A picture that was shown, and where it showed the ball.
#[derive(Clone, Copy)]
struct SeenPicture {
    sequence: u64,
    captured: Duration,
    camera_from_probe: Isometry3d,
}

struct SeenExposure {
    frame: ShorterFrame,
    /// Told by the pictures before and after it.
    camera_from_probe: Option<Isometry3d>,
}

type SeeingCamera = (&'static CameraFrame, &'static GlobalTransform, Option<&'static ShorterFrames>);
type SeenProbe =
    (&'static LightProbeSphere, &'static GlobalTransform, &'static ProbeMeasurement, &'static mut SeenExposures);

/// Finds out where the ball was in shorter exposures, in which nobody looks for markers.
pub(super) fn place_exposures(cameras: Query<SeeingCamera, With<ArCamera>>, mut probes: Query<SeenProbe>) {
    let Some((frame, camera, shorter)) = cameras.iter().next() else {
        return;
    };
    for (probe, transform, measurement, mut seen) in &mut probes {
        if probe.is_dark() {
            continue;
        }
        for new in shorter.iter().flat_map(|shorter| shorter.iter()) {
            seen.note(new);
        }
        let is_new = seen.newest.is_none_or(|newest| newest.sequence != frame.sequence);
        if is_new && measurement.is_in_view && measurement.sequence == frame.sequence {
            let camera_from_probe = camera.to_isometry().inverse() * transform.to_isometry();
            seen.place(SeenPicture { sequence: frame.sequence, captured: frame.captured, camera_from_probe });
        }
    }
}

impl SeenExposures {
    fn note(&mut self, new: &ShorterFrame) {
        let is_known = |seen: &SeenExposure| seen.frame.captured == new.captured && seen.frame.is_same_exposure(new);
        if !self.frames.iter().any(is_known) {
            // What has not been placed until now never will be: the next picture has not come.
            self.frames.retain(|seen| seen.camera_from_probe.is_some() || !seen.frame.is_same_exposure(new));
            self.frames.push(SeenExposure { frame: new.clone(), camera_from_probe: None });
        }
    }

    /// Places what was taken before a picture, and forgets what is old.
    fn place(&mut self, picture: SeenPicture) {
        let before = self.newest.replace(picture);
        for seen in self.frames.iter_mut().filter(|seen| seen.frame.captured <= picture.captured) {
            seen.camera_from_probe.get_or_insert_with(|| between(before, picture, seen.frame.captured));
        }
        self.frames.retain(|seen| seen.frame.captured.abs_diff(picture.captured) <= LONGEST_AGE);
        let placed: Vec<ShorterFrame> =
            self.frames.iter().filter(|seen| seen.camera_from_probe.is_some()).map(|seen| seen.frame.clone()).collect();
        self.frames.retain(|SeenExposure { frame, .. }| {
            !placed.iter().any(|newer| newer.captured > frame.captured && newer.is_same_exposure(frame))
        });
    }

    /// What is known of the newest picture's moment.
    pub(super) fn exposures(&self, world_from_probe: &GlobalTransform) -> Vec<ShorterExposure> {
        let probe_from_world = world_from_probe.to_isometry().inverse();
        let exposure = |seen: &SeenExposure| {
            let camera_from_world = Affine3A::from(seen.camera_from_probe? * probe_from_world);
            let ShorterFrame { pixels, exposure, .. } = seen.frame.clone();
            Some(ShorterExposure { frame: pixels, exposure, camera_from_world: Some(camera_from_world) })
        };
        self.frames.iter().filter_map(exposure).collect()
    }
}

/// Where the ball was between two pictures: on the straight way.
fn between(before: Option<SeenPicture>, after: SeenPicture, at: Duration) -> Isometry3d {
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

    fn frame(exposure: f32, milliseconds: u64) -> ShorterFrame {
        let pixels = Arc::new(FramePixels::new(UVec2::ONE, vec![0; 4]).expect("fits"));
        ShorterFrame { pixels, exposure, captured: Duration::from_millis(milliseconds) }
    }

    fn picture(sequence: u64, milliseconds: u64, x: f32) -> SeenPicture {
        let camera_from_probe = Isometry3d::from_xyz(x, 0.0, -1.0);
        SeenPicture { sequence, captured: Duration::from_millis(milliseconds), camera_from_probe }
    }

    /// Exposures that are told of, with the ball's place.
    fn told(seen: &SeenExposures) -> Vec<(f32, f32)> {
        let exposures = seen.exposures(&GlobalTransform::IDENTITY);
        exposures.iter().map(|e| (e.exposure, e.camera_from_world.expect("placed").translation.x)).collect()
    }

    #[test]
    fn a_moving_ball_was_between_its_places_in_the_pictures_before_and_after() {
        let mut seen = SeenExposures::default();
        seen.place(picture(1, 100, 0.0));
        seen.note(&frame(0.25, 150));
        seen.note(&frame(0.1, 350));
        assert_eq!(told(&seen), [], "where it was is not known yet");
        seen.place(picture(2, 300, 0.4));
        let [(exposure, x)] = told(&seen)[..] else { panic!("{:?}", told(&seen)) };
        assert!(exposure == 0.25 && (x - 0.1).abs() < 1e-6, "a quarter of the way");
        seen.place(picture(3, 400, 0.6));
        assert!((told(&seen)[1].1 - 0.5).abs() < 1e-6);
    }

    #[test]
    fn the_newest_of_each_exposure_is_told_of_until_it_is_old() {
        let mut seen = SeenExposures::default();
        for at in [0, 100, 200] {
            seen.note(&frame(0.25, at));
            seen.place(picture(at, at + 50, 0.001 * at as f32));
        }
        assert_eq!(told(&seen).len(), 1);
        seen.note(&frame(0.25, 200));
        assert_eq!(seen.frames.len(), 1, "the same once more");
        let end = 200 + LONGEST_AGE.as_millis() as u64;
        seen.place(picture(4, end, 0.0));
        assert_eq!(told(&seen).len(), 1);
        seen.place(picture(5, end + 1, 0.0));
        assert_eq!(told(&seen), []);
    }
}
