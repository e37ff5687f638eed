//! Cameras whose own picture is the light: fisheyes that look up, 360° cameras, pictures of balls that others took.

use super::{
    lens::{LensNumbers, ProbeLens},
    lens_error::LensError,
};
use crate::camera::CameraFrame;
use bevy::prelude::*;

/// A second camera that looks at the light itself; beside a [`CameraFeed`](crate::camera::CameraFeed) on an entity without an
/// [`ArCamera`](crate::camera::ArCamera). The entity's transform says where it looks (along −Z, +Y up).
///
/// What it sees goes into the one environment, together with what mirrored balls show: in each direction the finer picture wins.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::{LightProbeCamera, ProbeLens, FisheyeProjection}};
/// # fn setup(mut commands: Commands) {
/// // a fisheye on the desk that looks at the ceiling, its upper picture border towards −Z
/// let lens = ProbeLens::Fisheye { projection: FisheyeProjection::Equisolid, fov_degrees: 180.0, circle: None };
/// commands.spawn((
///     LightProbeCamera { lens, ..default() },
///     CameraFeed::picture("ceiling.jpg"),
///     Transform::default().looking_to(Vec3::Y, Vec3::NEG_Z),
/// ));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
#[require(Transform, Visibility, ProbeCameraState)]
pub struct LightProbeCamera {
    /// How its picture shows directions. Defaults to an equidistant fisheye of 180°.
    pub lens: ProbeLens,
    /// Factor that turns this camera's units into those of the AR camera, per channel: two cameras seldom agree on exposure and
    /// white balance; [`CameraMatch::gain`](crate::lighting::CameraMatch::gain) is it, measured. Finite and above 0. Defaults to 1.
    pub gain: Vec3,
}

impl Default for LightProbeCamera {
    fn default() -> Self {
        Self { lens: ProbeLens::default(), gain: Vec3::ONE }
    }
}

/// How a [`LightProbeCamera`] is doing.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub enum ProbeCameraState {
    /// No picture has arrived.
    #[default]
    Waiting,
    /// Its pictures become light.
    Measuring,
    /// Something is wrong with its numbers; the text says what to change.
    Refused(String),
}

/// What the unwrap pass has to know; compared to see whether it has to run again.
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
            let refused = ProbeCameraState::Refused(error.to_string());
            if *state != refused {
                error!("camera {entity}: {error}");
                *state = refused;
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
