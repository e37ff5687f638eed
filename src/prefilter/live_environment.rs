//! Live environments: sources of light that change while the game runs.

use super::{
    filtered_environment::FilteredEnvironment,
    refresh::{EnvironmentState, Refresh},
};
use crate::{
    camera::ArCamera,
    environment_map::{EnvironmentCube, LitByGame},
};
use bevy::{ecs::observer::On, light::EnvironmentMapLight, prelude::*};

/// Lights the view of a camera, or the surroundings of a [`LightProbe`], by a picture of the environment that changes while the
/// game runs.
///
/// An [`ArCamera`] gets one by itself as soon as a [`LightProbeSphere`](crate::probe::LightProbeSphere) exists. How far it is
/// says the [`EnvironmentState`] beside it. Taken from the entity, its lighting goes with it.
///
/// Units hold for the entity's own [`Exposure`]; a light probe without one follows that of the [`ArCamera`], else that of the active
/// `Camera3d` of the highest order.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::{LiveEnvironment, Refresh};
///
/// fn setup(mut commands: Commands, assets: Res<AssetServer>) {
///     let sky = assets.load("sky.hdr");
///     commands.spawn((Camera3d::default(), LiveEnvironment::new(sky).with_refresh(Refresh::OnChange)));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
#[require(EnvironmentState, LitByGame)]
pub struct LiveEnvironment {
    /// Linear radiance in frame buffer units (1.0 shows as 1.0), world axes. Either a cube (six square layers in Bevy's
    /// convention) or an equirectangular picture (twice as wide as high, column u/width is the azimuth from −Z towards +X,
    /// rows from +Y down), of any color format. Cubes with a power of two from 16 to 8192 as edge length are filtered as they
    /// are, all else is first resampled into a cube of at most 512. Changing the handle, and resizing the image, is fine.
    pub source: Handle<Image>,
    /// When the maps are made anew. Defaults to [`Refresh::EveryFrame`].
    pub refresh: Refresh,
}

impl LiveEnvironment {
    /// Lighting by `source`, refreshed every frame.
    pub fn new(source: Handle<Image>) -> Self {
        Self { source, refresh: Refresh::default() }
    }

    /// The same, refreshed as given.
    pub fn with_refresh(self, refresh: Refresh) -> Self {
        Self { refresh, ..self }
    }
}

type UnlitCamera = (With<ArCamera>, Without<LiveEnvironment>);

/// Lights cameras that have no environment of their own by the measured one.
pub(super) fn light_cameras_by_probe(
    mut commands: Commands,
    cameras: Query<Entity, UnlitCamera>,
    cubes: Query<&EnvironmentCube>,
) {
    let Some(cube) = cubes.iter().next() else {
        return;
    };
    for camera in &cameras {
        commands.entity(camera).insert(LiveEnvironment::new(cube.0.clone()).with_refresh(Refresh::OnChange));
    }
}

/// Removes the lighting with its [`LiveEnvironment`].
pub(super) fn remove_lighting(removed: On<Remove, LiveEnvironment>, mut commands: Commands) {
    if let Ok(mut entity) = commands.get_entity(removed.entity) {
        entity.try_remove::<(FilteredEnvironment, EnvironmentMapLight, EnvironmentState)>();
    }
}
