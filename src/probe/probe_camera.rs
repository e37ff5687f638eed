//! Probe cameras: cameras that face the light itself, such as fisheyes that look up and 360° cameras, and
//! photographs of balls from other sources.

use super::{
    lens::{LensNumbers, ProbeLens},
    lens_error::LensError,
};
use crate::camera::CameraFrame;
use bevy::prelude::*;

/// Second camera that faces the light itself. It belongs on an entity with a
/// [`CameraFeed`](crate::camera::CameraFeed) and without an [`ArCamera`](crate::camera::ArCamera). The entity's
/// transform is the camera's pose (it looks along −Z, +Y up).
///
/// Its frames and the mirrored balls contribute to one environment; in each direction the finer frame wins.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::{LightProbeCamera, ProbeLens, FisheyeProjection}};
/// # fn setup(mut commands: Commands) {
/// // A fisheye on the desk that looks at the ceiling, with the upper border of its frame towards −Z.
/// let lens = ProbeLens::Fisheye { projection: FisheyeProjection::Equisolid, fov_degrees: 180.0, circle: None };
/// commands.spawn((
///     LightProbeCamera { lens, ..default() },
///     CameraFeed::file("ceiling.jpg"),
///     Transform::default().looking_to(Vec3::Y, Vec3::NEG_Z),
/// ));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, ProbeCameraState)]
pub struct LightProbeCamera {
    /// Lens: the mapping between pixels and directions. Defaults to an equidistant fisheye of 180°.
    pub lens: ProbeLens,
    /// Factor from this camera's units to those of the AR camera, per channel, because two cameras seldom agree on
    /// exposure and white balance. [`CameraMatch::gain`](crate::lighting::CameraMatch::gain) measures it. Finite and
    /// above 0. Defaults to 1.
    pub gain: Vec3,
}

impl Default for LightProbeCamera {
    fn default() -> Self {
        Self { lens: ProbeLens::default(), gain: Vec3::ONE }
    }
}

/// State of a [`LightProbeCamera`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::probe::ProbeCameraState;
/// fn report(states: Query<&ProbeCameraState, Changed<ProbeCameraState>>) {
///     for state in &states {
///         if let ProbeCameraState::Failed(reason) = state {
///             warn!("{reason}");
///         }
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum ProbeCameraState {
    /// No frame has arrived.
    #[default]
    Waiting,
    /// Its frames contribute to the environment.
    Measuring,
    /// A setting is invalid; the text names it and its valid range.
    Failed(String),
}

impl ProbeCameraState {
    /// Old name of [`ProbeCameraState::Failed`].
    #[deprecated(since = "0.1.0", note = "use `ProbeCameraState::Failed`")]
    #[doc(hidden)]
    #[expect(non_snake_case, reason = "the name that the variant had")]
    pub fn Refused(reason: String) -> Self {
        Self::Failed(reason)
    }
}

/// View of one probe camera, as input of the unwrap pass. It is compared to detect whether the pass has to run again.
#[derive(Component, Clone, Copy, Debug, PartialEq)]
pub(crate) struct LensView {
    pub sequence: u64,
    pub numbers: LensNumbers,
    pub lens: ProbeLens,
    pub gain: Vec3,
    pub camera_from_world: Mat3,
}

type SeeingCamera = (
    Entity,
    &'static LightProbeCamera,
    &'static CameraFrame,
    &'static GlobalTransform,
    &'static mut ProbeCameraState,
    Option<&'static LensView>,
);

pub(super) fn update_lens_views(mut commands: Commands, mut cameras: Query<SeeingCamera>) {
    for (entity, camera, frame, place, mut state, view) in &mut cameras {
        let gain = camera.gain;
        let checked = camera.lens.check().and_then(|()| {
            let is_good = gain.is_finite() && gain.min_element() > 0.0;
            if is_good { Ok(()) } else { Err(LensError::Gain(gain)) }
        });
        if let Err(error) = checked {
            let failed = ProbeCameraState::Failed(error.to_string());
            if *state != failed {
                error!("camera {entity}: {error}");
                *state = failed;
                commands.entity(entity).remove::<LensView>();
            }
            continue;
        }
        state.set_if_neq(ProbeCameraState::Measuring);
        let rotation = place.rotation();
        let new = LensView {
            sequence: frame.sequence,
            numbers: camera.lens.numbers(frame.pixels.size),
            lens: camera.lens,
            gain,
            camera_from_world: Mat3::from_quat(rotation.inverse()),
        };
        if view != Some(&new) {
            commands.entity(entity).insert(new);
        }
    }
}
