//! Still poses: a low-pass filter whose cutoff rises with the speed.
//!
//! The one-euro filter (Casiez, Roussel & Vogel 2012) on the position and on the logarithm of the rotation, with two
//! additions. Fast movements are extrapolated by their filtered speed before the newest measurement corrects them, so
//! that a steady pan does not lag; and what moves farther than a jump is taken as it is measured. It runs on times of
//! capture, so it does not depend on when the game gets to a frame.
//!
//! Speeds and distances of positions are fractions of the distance from the camera. They count like radians then, which
//! is how large they look in the frame.

use super::PoseFilter;
use bevy::{
    ecs::entity::EntityHashMap,
    math::{DQuat, DVec3},
    prelude::*,
};
use std::{f64::consts::TAU, time::Duration};

/// Past of a marker in the frames of each camera; on the entity of its anchor.
#[derive(Component, Clone, Debug, Default)]
pub(crate) struct PoseHistories(EntityHashMap<PoseHistory>);

impl PoseHistories {
    /// Past in the frames of a camera.
    pub(super) fn of(&mut self, camera: Entity) -> &mut PoseHistory {
        self.0.entry(camera).or_default()
    }

    pub(super) fn get(&self, camera: Entity) -> Option<&PoseHistory> {
        self.0.get(&camera)
    }

    /// Forgets what other cameras saw.
    pub(super) fn retain(&mut self, is_kept: impl Fn(Entity) -> bool) {
        self.0.retain(|camera, _| is_kept(*camera));
    }
}

/// Past of a marker in the frames of one camera.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PoseHistory {
    /// The newest pose with its speed.
    pub pose: Option<FilteredPose>,
    /// Time of capture of the frame in which the marker appeared; `None` while it is lost.
    pub first_seen: Option<Duration>,
}

/// Speed in radians per second below which a marker is still, and for how long.
const STEADY_SPEED: f64 = 0.02;
const STEADY_TIME: Duration = Duration::from_millis(300);
/// Speed in radians per second from which half of it is extrapolated. Noise is slower.
const TREND_SPEED: f64 = 0.02;
/// Interval between frames above which speeds are unknown.
const MAX_INTERVAL: Duration = Duration::from_millis(500);
/// Longest prediction.
const MAX_PREDICTION: Duration = Duration::from_millis(100);

/// Pose of a marker in the frames of one camera, with its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FilteredPose {
    captured: Duration,
    measured: Pose,
    filtered: Pose,
    speed: Speed,
    steady_since: Option<Duration>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Pose {
    rotation: DQuat,
    translation: DVec3,
}

/// Rotation vector in radians, and translation in meters; or both per second.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Speed {
    turn: DVec3,
    shift: DVec3,
}

impl From<Isometry3d> for Pose {
    fn from(pose: Isometry3d) -> Self {
        Self { rotation: pose.rotation.as_dquat(), translation: Vec3::from(pose.translation).as_dvec3() }
    }
}

impl Pose {
    fn to_isometry(self) -> Isometry3d {
        Isometry3d::new(self.translation.as_vec3(), self.rotation.as_quat().normalize())
    }

    /// The way to here from another pose.
    fn since(&self, other: &Self) -> Speed {
        let turn = self.rotation * other.rotation.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        Speed { turn: turn.to_scaled_axis(), shift: self.translation - other.translation }
    }

    fn moved(&self, turn: DVec3, shift: DVec3) -> Self {
        Self {
            rotation: (DQuat::from_scaled_axis(turn) * self.rotation).normalize(),
            translation: self.translation + shift,
        }
    }
}

/// Weight of a new value in a low-pass filter of the first order.
fn weight(cutoff: f64, seconds: f64) -> f64 {
    let angle = TAU * cutoff * seconds;
    angle / (angle + 1.0)
}

impl FilteredPose {
    /// A marker that has just been found.
    fn new(measured: Isometry3d, captured: Duration) -> Self {
        let measured = measured.into();
        Self { captured, measured, filtered: measured, speed: Speed::default(), steady_since: None }
    }

    /// Takes the pose that was measured in a new frame. Without smoothing, the pose stays as measured, and only its
    /// speed is filtered.
    pub(super) fn follow(
        last: Option<Self>,
        measured: Isometry3d,
        captured: Duration,
        filter: &PoseFilter,
        is_smoothed: bool,
    ) -> Self {
        let Some(last) = last.filter(|last| {
            captured > last.captured && captured - last.captured <= MAX_INTERVAL && measured.translation.length() > 0.0
        }) else {
            return Self::new(measured, captured);
        };
        let seconds = (captured - last.captured).as_secs_f64();
        let measured = Pose::from(measured);
        let distance = measured.translation.length();
        let moved = measured.since(&last.measured);
        let by_speed = weight(filter.speed_cutoff.into(), seconds);
        let speed = Speed {
            turn: last.speed.turn.lerp(moved.turn / seconds, by_speed),
            shift: last.speed.shift.lerp(moved.shift / seconds, by_speed),
        };
        let (turning, shifting) = (speed.turn.length(), speed.shift.length() / distance);
        let trend = |speed: f64| seconds * speed * speed / (speed * speed + TREND_SPEED * TREND_SPEED);
        let expected = last.filtered.moved(speed.turn * trend(turning), speed.shift * trend(shifting));
        let rest = measured.since(&expected);
        let is_jump = rest.turn.length().max(rest.shift.length() / distance) > filter.jump.into();
        let by = |speed: f64| weight(f64::from(filter.min_cutoff) + f64::from(filter.speed_gain) * speed, seconds);
        let filtered = match is_jump || !is_smoothed {
            true => measured,
            false => expected.moved(rest.turn * by(turning), rest.shift * by(shifting)),
        };
        let is_still = !is_jump && turning.max(shifting) < STEADY_SPEED;
        let steady_since = is_still.then(|| last.steady_since.unwrap_or(captured));
        Self { captured, measured, filtered, speed, steady_since }
    }

    /// The filtered pose.
    pub(super) fn pose(&self) -> Isometry3d {
        self.filtered.to_isometry()
    }

    /// Whether the marker has been still for a while.
    pub(super) fn is_steady(&self) -> bool {
        self.steady_since.is_some_and(|since| self.captured - since >= STEADY_TIME)
    }

    /// The pose at a later time, if the marker goes on as fast.
    pub(super) fn predicted(&self, at: Duration) -> Isometry3d {
        let seconds = at.saturating_sub(self.captured).min(MAX_PREDICTION).as_secs_f64();
        self.filtered.moved(self.speed.turn * seconds, self.speed.shift * seconds).to_isometry()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: f64 = 30.0;

    fn at(frame: usize) -> Duration {
        Duration::from_secs_f64(frame as f64 / RATE)
    }

    /// Poses of a marker half a meter away that turns about the vertical.
    fn turned(degrees: f32) -> Isometry3d {
        Isometry3d::new(Vec3::new(0.05, 0.02, -0.5), Quat::from_rotation_y(degrees.to_radians()))
    }

    fn filtered(poses: &[Isometry3d], filter: &PoseFilter) -> Vec<FilteredPose> {
        let mut last = None;
        let mut follow = |(frame, pose): (usize, &Isometry3d)| {
            last = Some(FilteredPose::follow(last, *pose, at(frame), filter, true));
            last.expect("followed")
        };
        poses.iter().enumerate().map(&mut follow).collect()
    }

    fn degrees(pose: &FilteredPose, truth: Isometry3d) -> f64 {
        pose.filtered.since(&truth.into()).turn.length().to_degrees()
    }

    #[test]
    fn noise_shrinks_to_less_than_half() {
        let noise = |i: usize| ((i * 7919 % 101) as f32 / 50.0 - 1.0) * 0.2;
        let poses: Vec<_> = (0..60).map(|i| turned(noise(i))).collect();
        let spread = |off: &dyn Fn(usize) -> f64| (20..60).map(|i| off(i).powi(2)).sum::<f64>() / 40.0;
        let found = filtered(&poses, &PoseFilter::default());
        let before = spread(&|i| f64::from(noise(i)));
        let after = spread(&|i| degrees(&found[i], turned(0.0)));
        println!("standard deviation {:.3}° becomes {:.3}°", before.sqrt(), after.sqrt());
        assert!(after < before / 4.0);
        assert!(found[59].is_steady() && !found[5].is_steady());
    }

    #[test]
    fn a_step_is_followed_at_once_and_a_small_one_soon() {
        for (step, frames) in [(10.0, 1), (6.0, 1), (1.0, 6)] {
            let poses: Vec<_> = (0..60).map(|i| turned(if i < 30 { 0.0 } else { step })).collect();
            let found = filtered(&poses, &PoseFilter::default());
            let off = degrees(&found[29 + frames], turned(step));
            assert!(off <= 0.1 * f64::from(step), "{off}° are left of {step}° after {frames} frames");
            assert!(!found[30].is_steady());
        }
    }

    #[test]
    fn a_steady_pan_does_not_lag_by_a_frame() {
        for speed in [2.0, 10.0, 60.0] {
            let truth = |i: usize| turned(speed * i as f32 / RATE as f32);
            let poses: Vec<_> = (0..45).map(truth).collect();
            let found = filtered(&poses, &PoseFilter::default());
            let lag = degrees(&found[44], truth(44)) * RATE / f64::from(speed);
            println!("{speed}°/s lag by {lag:.2} frames");
            assert!(lag < 1.0, "{speed}°/s lag by {lag} frames");
            let ahead = Pose::from(found[44].predicted(at(46))).since(&truth(46).into());
            let ahead = ahead.turn.length().to_degrees() * RATE / f64::from(speed);
            assert!(ahead < 1.0, "{speed}°/s, predicted by two frames, are off by {ahead} frames");
        }
    }

    #[test]
    fn what_is_not_smoothed_stays_as_measured_and_a_long_gap_starts_anew() {
        let first = FilteredPose::follow(None, turned(0.0), at(0), &PoseFilter::default(), false);
        let second = FilteredPose::follow(Some(first), turned(1.0), at(1), &PoseFilter::default(), false);
        assert_eq!(second.filtered, turned(1.0).into());
        let late = FilteredPose::follow(Some(second), turned(2.0), at(60), &PoseFilter::default(), true);
        assert_eq!(late, FilteredPose::new(turned(2.0), at(60)));
    }
}
