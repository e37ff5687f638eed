//! What a new user has to put right, in the order in which it matters.

use crate::{
    camera::{ArCamera, CameraFrame, FeedState, FeedStatistics},
    probe::ProbeMeasurement,
    shadows::ShadowDomeLight,
    tracking::{MarkerAnchor, MarkerState, MarkerTracking},
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// How well one thing is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CheckLevel {
    /// As it should be.
    Good,
    /// It works, and could be better.
    Warning,
    /// It keeps the light from being measured.
    Missing,
}

/// One line of the checklist.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// How well it is.
    pub level: CheckLevel,
    /// What it is about: a word.
    pub topic: &'static str,
    /// What was found and, unless it is good, what to do.
    pub text: String,
}

/// From this share of clipped pixels on, the ball's picture loses too much light.
const TOO_MUCH_CLIPPED: f32 = 0.2;

type CheckedCamera =
    (&'static ArCamera, Option<&'static FeedState>, Option<&'static FeedStatistics>, Option<&'static CameraFrame>);

/// Looks after feed, marker, ball and exposure; a system parameter for panels of a game's own.
///
/// ```
/// # use bevy::prelude::*;
/// use bevy_mirrorball::debug::Checklist;
///
/// fn print(checklist: Checklist) {
///     for check in checklist.checks() {
///         println!("{:?} {}: {}", check.level, check.topic, check.text);
///     }
/// }
/// ```
#[derive(SystemParam)]
pub struct Checklist<'w, 's> {
    cameras: Query<'w, 's, CheckedCamera>,
    anchors: Query<'w, 's, (&'static MarkerAnchor, &'static MarkerTracking)>,
    probes: Query<'w, 's, &'static ProbeMeasurement>,
    domes: Query<'w, 's, (), With<ShadowDomeLight>>,
}

impl Checklist<'_, '_> {
    /// All lines: feed, field of view, markers, ball, exposure, shadows. The first camera's.
    pub fn checks(&self) -> Vec<Check> {
        let check = |level, topic, text: String| Check { level, topic, text };
        let Some((ar_camera, state, statistics, frame)) = self.cameras.iter().next() else {
            let text = "there is no ArCamera; spawn one with a CameraFeed".to_owned();
            return vec![check(CheckLevel::Missing, "camera", text)];
        };
        let (level, text) = match (state, frame) {
            (Some(FeedState::Failed(reason) | FeedState::Lost(reason)), _) => (CheckLevel::Missing, reason.clone()),
            (_, Some(frame)) => {
                let statistics = statistics.cloned().unwrap_or_default();
                let (size, rate, dropped) = (frame.pixels.size, statistics.capture_rate, statistics.dropped);
                let mut text = format!("{} × {}, {rate:.1} /s, {dropped} dropped", size.x, size.y);
                if statistics.shorter > 0 {
                    text += &format!(", {} at shorter exposures", statistics.shorter);
                }
                (CheckLevel::Good, text)
            }
            (Some(_), None) => (CheckLevel::Missing, "waiting for the first picture".to_owned()),
            (None, None) => (CheckLevel::Missing, "the camera has no CameraFeed".to_owned()),
        };
        let mut checks = vec![check(level, "feed", text)];
        if let Some(frame) = frame {
            let is_known = ar_camera.intrinsics.is_some() || frame.intrinsics.is_some();
            let text = if is_known {
                "intrinsics are known"
            } else {
                "a field of view of 60° is assumed; calibrate the camera"
            };
            let level = if is_known { CheckLevel::Good } else { CheckLevel::Warning };
            checks.push(check(level, "lens", text.to_owned()));
        }
        checks.extend(self.anchors.iter().map(|(anchor, tracking)| {
            let (level, text) = match tracking.state {
                MarkerState::Tracked => {
                    (CheckLevel::Good, format!("number {}, off by {:.2} px", anchor.id, tracking.reprojection_error))
                }
                MarkerState::Lost => (
                    CheckLevel::Missing,
                    format!("number {} is lost, its last pose stays; show it whole and sharp", anchor.id),
                ),
                MarkerState::Searching => (
                    CheckLevel::Missing,
                    format!("number {} not seen yet; show it whole, sharp and 40 pixels wide", anchor.id),
                ),
            };
            check(level, "marker", text)
        }));
        if self.anchors.is_empty() {
            checks.push(check(CheckLevel::Warning, "marker", "there is no MarkerAnchor".to_owned()));
        }
        let probe = self.probes.iter().next();
        checks.push(match probe {
            Some(probe) if probe.is_in_view => {
                let width = 2.0 * probe.outline.semi_axes.x;
                check(CheckLevel::Good, "ball", format!("{width:.0} px wide"))
            }
            Some(probe) if probe.sequence > 0 => {
                check(CheckLevel::Missing, "ball", "out of view; the last light stays".to_owned())
            }
            Some(_) => check(CheckLevel::Missing, "ball", "not seen yet; it has to be where the scene says".to_owned()),
            None => check(CheckLevel::Warning, "ball", "there is no LightProbeSphere".to_owned()),
        });
        if let Some(probe) = probe.filter(|probe| probe.is_in_view) {
            let (level, advice) = if probe.clipped_fraction > TOO_MUCH_CLIPPED {
                (CheckLevel::Warning, "; lower the camera's exposure")
            } else {
                (CheckLevel::Good, "")
            };
            checks.push(check(
                level,
                "exposure",
                format!("{:.0} % of the ball clipped{advice}", 100.0 * probe.clipped_fraction),
            ));
        }
        if self.domes.is_empty() {
            checks.push(check(CheckLevel::Warning, "shadows", "there is no ShadowDomeLight".to_owned()));
        }
        checks
    }
}
