//! Event of the first measurement, and a run condition on the origin of the light.

use super::{
    fallback::EnvironmentOrigin, light_probe_sphere::LightProbeSphere, probe_camera::LensView,
    probe_measurement::ProbeMeasurement,
};
use bevy::prelude::*;

/// Event that a probe begins to give light. Triggered on the entity of the [`LightProbeSphere`] or
/// [`LightProbeCamera`](super::LightProbeCamera), once, in the update of the first frame that shows the ball
/// ([`ProbeMeasurement::is_in_view`]) or comes from the probe camera; again only if a ball was out of view or a probe
/// camera had failed in between. Further frames trigger nothing, nor do dark balls, which give no light of their own.
///
/// The environment is drawn in the same update, and the [`EnvironmentOrigin`] of each camera is already
/// [`Measured`](EnvironmentOrigin::Measured). It stays so when the ball is out of view, unlike
/// [`ProbeMeasurement::is_in_view`].
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::*, probe::EnvironmentMeasured};
/// # fn setup(mut commands: Commands) {
/// commands
///     .spawn((LightProbeSphere { radius: 0.05, ..default() }, Transform::from_xyz(0.17, 0.05, 0.01)))
///     .observe(|measured: On<EnvironmentMeasured>| info!("{} shows the room", measured.entity));
/// # }
/// ```
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Event, Debug, Clone, PartialEq)]
pub struct EnvironmentMeasured {
    /// Entity of the probe.
    pub entity: Entity,
    /// Camera in whose frames it was measured: an [`ArCamera`](crate::camera::ArCamera), or the probe camera itself.
    pub camera: Entity,
}

/// Whether the ball was in view when its measurement last changed.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(super) struct WasInView(bool);

type ChangedBall = (Entity, &'static LightProbeSphere, &'static ProbeMeasurement, &'static mut WasInView);

/// Triggers an event for each probe whose first frame was measured.
pub(super) fn report_measurements(
    mut commands: Commands,
    mut balls: Query<ChangedBall, Changed<ProbeMeasurement>>,
    lenses: Query<Entity, Added<LensView>>,
) {
    for (entity, ball, measurement, mut was_in_view) in &mut balls {
        let is_new = measurement.is_in_view && !was_in_view.0;
        was_in_view.0 = measurement.is_in_view;
        if let Some(camera) = measurement.camera().filter(|_| is_new && !ball.is_dark()) {
            commands.trigger(EnvironmentMeasured { entity, camera });
        }
    }
    for entity in &lenses {
        commands.trigger(EnvironmentMeasured { entity, camera: entity });
    }
}

/// Run condition: the scene of an [`ArCamera`](crate::camera::ArCamera) is lit by what a probe has shown, and no longer
/// by its [`EnvironmentFallback`](super::EnvironmentFallback): from the first [`EnvironmentMeasured`] on.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::probe::is_lit_by_measurement;
/// # fn ask_for_the_ball() {}
/// # let mut app = App::new();
/// app.add_systems(Update, ask_for_the_ball.run_if(not(is_lit_by_measurement)));
/// ```
pub fn is_lit_by_measurement(origins: Query<&EnvironmentOrigin>) -> bool {
    origins.iter().any(|origin| *origin == EnvironmentOrigin::Measured)
}
