//! What was seen of a probe.

use super::ellipse::Ellipse;
use bevy::prelude::*;
use std::time::Duration;

/// What was seen of a probe in the newest picture; on the entity of its [`LightProbeSphere`].
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ProbeMeasurement {
    /// Sequence number of the picture it was measured in; 0 while there has been none.
    pub sequence: u64,
    /// Whether the ball is in view: in front of the camera with at least a third of its outline's box inside the picture.
    /// Otherwise the last good environment stays.
    pub is_in_view: bool,
    /// Share of all directions that the ball shows now, 0…1: about 0.9 for a ball in full view, less where a phantom or the picture's
    /// border covers it. The others keep what was seen lately, or are guessed; the alpha of the
    /// [`EnvironmentCube`](super::EnvironmentCube) says which.
    pub seen_fraction: f32,
    /// Outline of the ball in the picture.
    pub outline: Ellipse,
    /// Share of the ball's pixels of which at least one channel is clipped, 0…1.
    pub clipped_fraction: f32,
    /// Gain of clipped light straight above the marker's paper, per channel; 1 without recovery. From a direction at an angle to
    /// the paper's normal the factor is 1 + (gain − 1) · cosine. Where the desk tells more,
    /// [`RecoveredLight`](crate::lighting::RecoveredLight) holds instead.
    pub gain: Vec3,
    /// Radiance of the marker's paper in linear camera units, if a marker was seen.
    pub paper: Option<Vec3>,
    /// Time the measurement took on the CPU.
    pub cpu_time: Duration,
    pub(crate) view: Option<ProbeView>,
}

/// Everything the unwrap pass has to know; compared to see whether it has to run again.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub(crate) struct ProbeView {
    pub camera: Entity,
    pub camera_from_world: Mat3,
    pub center_camera: Vec3,
    pub radius: f32,
    pub reflectance: f32,
    pub edge_angle: f32,
    pub focal: Vec2,
    pub center: Vec2,
    pub gain: Vec3,
    pub up_camera: Vec3,
    pub uniform_radiance: Option<Vec3>,
}
