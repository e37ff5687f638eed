//! Checklist of the measurement setup for new users, in order of importance.

use crate::{
    camera::{ArCamera, CameraFrame, Distortion, FeedState, FeedStatistics, camera_rank},
    probe::ProbeMeasurement,
    shadows::ShadowDomeLight,
    tracking::{DetectedMarkers, MarkerAnchor, MarkerState, MarkerTracking},
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Severity of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CheckLevel {
    /// The subject is in order.
    Good,
    /// The measurement works, but could be better.
    Warning,
    /// The light cannot be measured.
    Missing,
}

/// Line of the checklist.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Severity.
    pub level: CheckLevel,
    /// Short name of the subject, for example `marker`.
    pub topic: &'static str,
    /// Finding and, unless the level is [`CheckLevel::Good`], the remedy.
    pub text: String,
}

/// Fraction of clipped pixels above which the image of the ball loses too much light.
const MAX_CLIPPED_FRACTION: f32 = 0.2;

type CheckedCamera = (
    Entity,
    &'static Camera,
    &'static ArCamera,
    Option<&'static FeedState>,
    Option<&'static FeedStatistics>,
    Option<&'static CameraFrame>,
    Option<&'static DetectedMarkers>,
);

/// Checks of feed, marker, ball and exposure, as a system parameter for a game's own panels.
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
    /// Returns all lines for the first camera: feed, field of view, markers, ball, exposure, shadows.
    pub fn checks(&self) -> Vec<Check> {
        let first = self.cameras.iter().min_by_key(|(entity, camera, ..)| camera_rank(*entity, camera));
        let Some((_, _, ar_camera, state, statistics, frame, detected)) = first else {
            return vec![Check::new(
                CheckLevel::Missing,
                "camera",
                "there is no ArCamera; spawn one with a CameraFeed",
            )];
        };
        let probe = self.probes.iter().next();
        let mut checks = vec![check_feed(state, statistics, frame)];
        checks.extend(frame.map(|frame| check_lens(ar_camera, frame)));
        checks.extend(self.anchors.iter().map(|(anchor, tracking)| check_marker(anchor, tracking, detected)));
        if self.anchors.is_empty() {
            checks.push(Check::new(CheckLevel::Warning, "marker", "there is no MarkerAnchor"));
        }
        checks.push(check_ball(probe));
        checks.extend(probe.filter(|probe| probe.is_in_view).map(check_exposure));
        if self.domes.is_empty() {
            checks.push(Check::new(CheckLevel::Warning, "shadows", "there is no ShadowDomeLight"));
        }
        checks
    }
}

impl Check {
    fn new(level: CheckLevel, topic: &'static str, text: impl Into<String>) -> Self {
        Self { level, topic, text: text.into() }
    }
}

fn check_feed(state: Option<&FeedState>, statistics: Option<&FeedStatistics>, frame: Option<&CameraFrame>) -> Check {
    let (level, text) = match (state, frame) {
        (Some(FeedState::Failed(reason) | FeedState::Lost(reason)), _) => (CheckLevel::Missing, reason.clone()),
        (_, Some(frame)) => {
            let statistics = statistics.cloned().unwrap_or_default();
            let (size, rate, dropped) = (frame.pixels.size, statistics.capture_rate, statistics.dropped);
            let mut text = format!("{} × {}, {rate:.1} /s, {dropped} dropped", size.x, size.y);
            if statistics.bracketed > 0 {
                text += &format!(", {} at shorter exposures", statistics.bracketed);
            }
            (CheckLevel::Good, text)
        }
        (Some(_), None) => (CheckLevel::Missing, "waiting for the first picture".to_owned()),
        (None, None) => (CheckLevel::Missing, "the camera has no CameraFeed".to_owned()),
    };
    Check::new(level, "feed", text)
}

fn check_lens(camera: &ArCamera, frame: &CameraFrame) -> Check {
    let known = camera.intrinsics.or(frame.intrinsics);
    let Some(lens) = known else {
        let text = "never calibrated, a field of view of 60° is assumed; measure it with the example `calibrate`";
        return Check::new(CheckLevel::Warning, "lens", text);
    };
    if let Some(problem) = lens.problem(frame.pixels.size) {
        return Check::new(CheckLevel::Warning, "lens", problem.to_string());
    }
    let text = match lens.distortion {
        Distortion::NONE => "intrinsics are known, without distortion",
        _ => "calibrated, frames are undistorted",
    };
    Check::new(CheckLevel::Good, "lens", text)
}

fn check_marker(anchor: &MarkerAnchor, tracking: &MarkerTracking, detected: Option<&DetectedMarkers>) -> Check {
    let marker = anchor.marker();
    let is_mirrored = detected.is_some_and(|detected| detected.mirrored.contains(&marker));
    let copies = tracking.copies;
    let (level, text) = match tracking.state {
        MarkerState::Lost | MarkerState::Searching if is_mirrored => {
            let text = format!("{marker} is only in the frame's mirror image; switch the camera's mirroring off");
            (CheckLevel::Missing, text)
        }
        _ if copies > 1 => {
            let text = format!("{marker} is on {copies} sheets in the frame, one is followed; cover the others");
            (CheckLevel::Warning, text)
        }
        MarkerState::Tracked => (CheckLevel::Good, format!("{marker}, off by {:.2} px", tracking.reprojection_error)),
        MarkerState::Held => (CheckLevel::Good, format!("{marker} is out of view for a moment")),
        MarkerState::Lost => {
            (CheckLevel::Missing, format!("{marker} is lost, its last pose stays; show it whole and sharp"))
        }
        MarkerState::Searching => {
            (CheckLevel::Missing, format!("{marker} not seen yet; show it whole, sharp and 40 pixels wide"))
        }
    };
    Check::new(level, "marker", text)
}

fn check_ball(probe: Option<&ProbeMeasurement>) -> Check {
    match probe {
        Some(probe) if probe.is_in_view => {
            Check::new(CheckLevel::Good, "ball", format!("{:.0} px wide", 2.0 * probe.outline.semi_axes.x))
        }
        Some(probe) if probe.sequence > 0 => {
            Check::new(CheckLevel::Missing, "ball", "out of view; the last light stays")
        }
        Some(_) => Check::new(CheckLevel::Missing, "ball", "not seen yet; it has to be where the scene says"),
        None => Check::new(CheckLevel::Warning, "ball", "there is no LightProbeSphere"),
    }
}

fn check_exposure(probe: &ProbeMeasurement) -> Check {
    let (level, advice) = if probe.clipped_fraction > MAX_CLIPPED_FRACTION {
        (CheckLevel::Warning, "; lower the camera's exposure")
    } else {
        (CheckLevel::Good, "")
    };
    Check::new(level, "exposure", format!("{:.0} % of the ball clipped{advice}", 100.0 * probe.clipped_fraction))
}
