//! Live environments: lighting by images that change while the game runs.

use super::{
    filtered_environment::FilteredEnvironment,
    refresh::{EnvironmentState, Refresh},
    specular_lobe::SpecularLobe,
};
use crate::{
    camera::ArCamera,
    environment_map::{EnvironmentCube, LitByGame},
    probe::OwnEnvironment,
};
use bevy::{ecs::observer::On, light::EnvironmentMapLight, prelude::*};

/// Image-based lighting of a camera's view, or of the surroundings of a [`LightProbe`], by an environment that
/// changes while the game runs.
///
/// An [`ArCamera`] gets this component automatically as soon as a
/// [`LightProbeSphere`](crate::probe::LightProbeSphere) exists. [`EnvironmentState`] on the same entity reports
/// progress. Removing this component removes the lighting.
///
/// The intensity is matched to the entity's own [`Exposure`](bevy::camera::Exposure). A light probe without one uses
/// that of the [`ArCamera`], else that of the active `Camera3d` of the highest order.
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
#[derive(Component, FromTemplate, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
#[require(EnvironmentState, LitByGame)]
pub struct LiveEnvironment {
    /// Environment as an image: linear radiance in frame buffer units (1.0 is displayed as 1.0), world axes, of any
    /// color format. Either a cube (six square layers in Bevy's convention) or an equirectangular image (twice as
    /// wide as high; column ÷ width is the azimuth from −Z towards +X, rows run from +Y down).
    ///
    /// Cubes whose edge length is a power of two from 16 to 8192 are filtered as they are. Any other source is first
    /// resampled into a cube of at most 512. The handle may be changed and the image may be resized at any time.
    pub source: Handle<Image>,
    /// When the maps are made again. Defaults to [`Refresh::EveryFrame`].
    pub refresh: Refresh,
    /// Shape of reflections on rough surfaces. Defaults to [`SpecularLobe::Ggx`].
    pub lobe: SpecularLobe,
}

impl LiveEnvironment {
    /// Lighting by `source`, refreshed every frame, with GGX lobes.
    pub fn new(source: Handle<Image>) -> Self {
        Self { source, refresh: Refresh::default(), lobe: SpecularLobe::default() }
    }

    /// The same lighting with another refresh policy.
    pub fn with_refresh(self, refresh: Refresh) -> Self {
        Self { refresh, ..self }
    }

    /// The same lighting with other lobes of reflections.
    pub fn with_lobe(self, lobe: SpecularLobe) -> Self {
        Self { lobe, ..self }
    }
}

type UnlitCamera = (With<ArCamera>, Without<LiveEnvironment>);

/// Lights cameras that have no environment of their own with the measured one.
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

type SeeingCamera = (&'static OwnEnvironment, &'static EnvironmentCube, &'static mut LiveEnvironment);

/// Lights a camera with the environment in its own units once there is one. What a game has chosen stays.
pub(super) fn light_cameras_by_own_frames(mut cameras: Query<SeeingCamera, With<ArCamera>>) {
    for (own, shared, mut environment) in &mut cameras {
        if own.is_written() && environment.source == shared.0 {
            environment.source = own.cube.0.clone();
        }
    }
}

/// Removes the lighting with its [`LiveEnvironment`].
pub(super) fn remove_lighting(removed: On<Remove, LiveEnvironment>, mut commands: Commands) {
    if let Ok(mut entity) = commands.get_entity(removed.entity) {
        entity.try_remove::<(FilteredEnvironment, EnvironmentMapLight, EnvironmentState)>();
    }
}
