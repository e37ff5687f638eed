//! Results of measuring a mirrored ball.

use super::ellipse::Ellipse;
use bevy::prelude::*;
use std::time::Duration;

/// Measurement of a mirrored ball in the newest frame, on the entity of its
/// [`LightProbeSphere`](super::LightProbeSphere).
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::probe::ProbeMeasurement;
/// fn is_exposure_good(balls: Query<&ProbeMeasurement>) -> bool {
///     balls.iter().any(|ball| ball.is_in_view && ball.clipped_fraction < 0.2)
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ProbeMeasurement {
    /// Sequence number of the frame in which the ball was measured; 0 before the first one.
    pub sequence: u64,
    /// Whether the ball is in view: in front of the camera, with at least a third of its outline's bounding box
    /// inside the frame. While it is not, the last good environment stays.
    pub is_in_view: bool,
    /// Fraction of all directions that the ball shows in this frame, 0…1: about 0.9 for a ball in full view, less
    /// where a phantom or the frame's border covers it. The other directions keep what was seen before, or are
    /// guessed; the alpha of the [`EnvironmentCube`](super::EnvironmentCube) distinguishes them.
    pub seen_fraction: f32,
    /// Outline of the ball in the frame.
    pub outline: Ellipse,
    /// Fraction of the ball's pixels in which at least one channel is clipped, 0…1. With a live feed that of a frame
    /// before, as is the gain.
    pub clipped_fraction: f32,
    /// Gain of clipped light from straight above the marker's paper, per channel; 1 without recovery. From a
    /// direction at an angle to the paper's normal the factor is 1 + (gain − 1) · cosine. Where the desk gives
    /// more evidence, [`RecoveredLight`](crate::lighting::RecoveredLight) replaces this gain.
    pub gain: Vec3,
    /// Radiance of the marker's paper in linear camera units; `None` if no marker was detected in the frame.
    pub paper: Option<Vec3>,
    /// CPU time of the measurement.
    pub cpu_time: Duration,
    pub(crate) view: Option<ProbeView>,
}

impl ProbeMeasurement {
    /// Entity of the [`ArCamera`](crate::camera::ArCamera) in whose frames the ball was last in view. With several
    /// cameras a ball is measured by the first that has seen a marker and the ball, as long as the ball stays in view.
    pub fn camera(&self) -> Option<Entity> {
        self.view.map(|view| view.camera)
    }

    /// Whether the ball is in view in this frame of this camera.
    pub(crate) fn is_of(&self, camera: Entity, sequence: u64) -> bool {
        self.is_in_view && self.sequence == sequence && self.camera() == Some(camera)
    }
}

/// View of one ball, as input of the unwrap pass. It is compared to detect whether the pass has to run again.
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
