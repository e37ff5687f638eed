//! Update of maps and lights when the source of an environment changes.

use super::{
    filtered_environment::FilteredEnvironment,
    live_environment::LiveEnvironment,
    parallax::DeskParallax,
    refresh::{EnvironmentState, Refresh},
    source::SourceShape,
    specular_lobe::SpecularLobe,
    viewing_camera::{ViewingCamera, unit_intensity},
};
use bevy::{asset::LoadState, camera::Exposure, light::EnvironmentMapLight, prelude::*};

/// Maps that an environment needs.
struct Wanted<'a> {
    source: &'a Handle<Image>,
    shape: SourceShape,
    refresh: Refresh,
    lobe: SpecularLobe,
    viewpoint: Option<Vec4>,
}

impl Wanted<'_> {
    /// Whether existing maps serve as well. Maps for a viewpoint are never shared.
    fn can_share(&self, maps: &FilteredEnvironment) -> bool {
        let is_same = maps.source == *self.source && maps.shape == self.shape;
        is_same
            && (maps.refresh, maps.lobe) == (self.refresh, self.lobe)
            && maps.viewpoint.is_none()
            && self.viewpoint.is_none()
    }

    fn allocate(&self, images: &mut Assets<Image>) -> FilteredEnvironment {
        FilteredEnvironment::allocate(
            images,
            self.source.clone(),
            self.shape,
            (self.refresh, self.lobe),
            self.viewpoint,
        )
    }
}

type Environment = (
    Entity,
    &'static LiveEnvironment,
    &'static mut EnvironmentState,
    Option<&'static FilteredEnvironment>,
    Option<&'static Exposure>,
    Option<(&'static DeskParallax, &'static GlobalTransform)>,
);

/// Allocates maps for environments whose source has arrived, changed its size or been replaced.
pub(super) fn update_environments(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    assets: Res<AssetServer>,
    mut environments: Query<Environment>,
    viewing: ViewingCamera<()>,
    existing: Query<&FilteredEnvironment>,
    mut new: Local<Vec<FilteredEnvironment>>,
) {
    for (entity, environment, mut state, maps, exposure, parallax) in &mut environments {
        let viewpoint = parallax.map(|(parallax, place)| parallax.viewpoint(place.translation()));
        let maps = maps.filter(|maps| {
            maps.source == environment.source
                && (maps.refresh, maps.lobe) == (environment.refresh, environment.lobe)
                && maps.viewpoint.is_some() == viewpoint.is_some()
        });
        let next = match images.get(&environment.source).map(SourceShape::of) {
            // Images that exist only on the GPU may have left the assets.
            None if maps.is_some() => continue,
            None => match assets.get_load_state(&environment.source) {
                Some(LoadState::Failed(error)) => {
                    EnvironmentState::Failed(format!("LiveEnvironment.source cannot be loaded: {error}"))
                }
                _ => EnvironmentState::Waiting,
            },
            Some(Err(reason)) => EnvironmentState::Failed(reason),
            Some(Ok(shape)) if maps.is_some_and(|maps| maps.shape == shape) => continue,
            Some(Ok(shape)) => {
                let LiveEnvironment { source, refresh, lobe } = environment;
                let wanted = Wanted { source, shape, refresh: *refresh, lobe: *lobe, viewpoint };
                let shared = existing.iter().chain(new.iter()).find(|maps| wanted.can_share(maps)).cloned();
                let maps = shared.unwrap_or_else(|| {
                    let maps = wanted.allocate(&mut images);
                    new.push(maps.clone());
                    maps
                });
                let light = EnvironmentMapLight {
                    diffuse_map: maps.diffuse.clone(),
                    specular_map: maps.specular.clone(),
                    intensity: unit_intensity(Some(&exposure.copied().unwrap_or_else(|| viewing.exposure()))),
                    ..default()
                };
                commands.entity(entity).insert((maps, light));
                *state = EnvironmentState::Live { refreshes: 0, frames_since_refresh: 0 };
                continue;
            }
        };
        if *state != next {
            if let EnvironmentState::Failed(reason) = &next {
                error!("{entity}: {reason}");
            }
            *state = next;
            commands.entity(entity).remove::<(FilteredEnvironment, EnvironmentMapLight)>();
        }
    }
    new.clear();
}

type LitEntity = (&'static mut EnvironmentMapLight, Option<&'static Exposure>);

/// Keeps 1.0 in the source at 1.0 in the frame buffer when the exposure changes.
pub(super) fn update_intensities(mut lights: Query<LitEntity, With<FilteredEnvironment>>, viewing: ViewingCamera<()>) {
    for (mut light, exposure) in &mut lights {
        let intensity = unit_intensity(Some(&exposure.copied().unwrap_or_else(|| viewing.exposure())));
        if light.intensity != intensity {
            light.intensity = intensity;
        }
    }
}
