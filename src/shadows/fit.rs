//! Fits the dome to its settings, casters and lights, and reads back how strong its directions are.

use super::{
    atlas::{DomeTextures, WEIGHT_BYTES},
    bounding_sphere::BoundingSphere,
    casters::Casters,
    directions::Directions,
    dome_light::{DomeCoverage, DomeState, ShadowDomeLight},
    fitted_dome::{FittedDome, Refreshing},
    key_lights::{KeyLight, KeySearch},
    lights_file::{DomeLights, FileViews, LightsFile},
};
use crate::{camera::ArCamera, environment_map::EnvironmentCube, lighting::RealLight, luminance::luminance};
use bevy::{
    camera::visibility::RenderLayers,
    ecs::system::SystemParam,
    prelude::*,
    render::gpu_readback::{Readback, ReadbackComplete},
};
use std::sync::Arc;

/// Filter for Bevy's lamps, whose light falls on real things too.
pub(crate) type Lamp = Or<(With<PointLight>, With<SpotLight>, With<DirectionalLight>)>;

type DomeItem = (
    &'static ShadowDomeLight,
    &'static GlobalTransform,
    &'static mut DomeState,
    Option<&'static DomeLights>,
    Option<&'static RenderLayers>,
);

/// The lights that a dome follows.
#[derive(SystemParam)]
pub(super) struct DomeScene<'w, 's> {
    files: Res<'w, Assets<LightsFile>>,
    lights: Query<'w, 's, &'static RealLight>,
    lamps: Query<'w, 's, (), Lamp>,
    probes: Query<'w, 's, &'static GlobalTransform, (With<EnvironmentCube>, Without<ArCamera>)>,
}

impl DomeScene<'_, '_> {
    /// Returns the real lights that become key lights of a dome.
    fn key_lights(
        &self,
        dome: &ShadowDomeLight,
        up: Vec3,
        directions: &Directions,
        casters: Option<BoundingSphere>,
        last: &[Option<KeyLight>],
    ) -> Vec<Option<KeyLight>> {
        let search = KeySearch {
            slots: dome.key_lights.min(ShadowDomeLight::MAX_KEY_LIGHTS),
            directions: directions.shadowed.len() as u32,
            coverage: dome.coverage,
            up,
            measured_from: self.probes.iter().next().map(GlobalTransform::translation),
            casters,
            last,
        };
        search.choose(self.lights.iter())
    }
}

/// Directions spread by the settings, kept because every frame needs them again.
#[derive(Default)]
pub(super) struct SpreadDirections(Option<(DomeCoverage, u32, Directions)>);

impl SpreadDirections {
    fn of(&mut self, dome: &ShadowDomeLight) -> Directions {
        let (coverage, count) = (dome.coverage, dome.clamped_directions());
        let (_, _, directions) = match self.0.take() {
            Some(last) if (last.0, last.1) == (coverage, count) => self.0.insert(last),
            _ => self.0.insert((coverage, count, Directions::spread(coverage, count))),
        };
        directions.clone()
    }
}

/// Follows the first dome's settings, casters and lights, and chooses the shadow maps to draw again.
pub(super) fn fit_dome(
    mut fitted: ResMut<FittedDome>,
    mut refreshing: ResMut<Refreshing>,
    mut domes: Query<DomeItem>,
    mut casters: Casters,
    scene: DomeScene,
    mut spread: Local<SpreadDirections>,
) {
    let refreshing = &mut *refreshing;
    let Some((dome, transform, mut state, file, layers)) = domes.iter_mut().next() else {
        fitted.set_if_neq(FittedDome::default());
        *refreshing = Refreshing { readback: refreshing.readback, ..default() };
        return;
    };
    let casters = casters.gather(layers);
    let spheres: Vec<_> = casters.iter().map(|caster| caster.sphere).collect();
    let sphere = BoundingSphere::around(&spheres).map(|sphere| sphere.or_keep(fitted.sphere));
    let FileViews { directions, views: file_views } = match file.and_then(|file| scene.files.get(&file.0)) {
        Some(file) => file.views(dome.coverage, transform),
        None => FileViews { directions: spread.of(dome), views: Arc::default() },
    };
    let now = FittedDome {
        keys: scene.key_lights(dome, *transform.up(), &directions, sphere, &fitted.keys),
        directions,
        file_views,
        world_from_dome: transform.rotation(),
        filter: dome.filter,
        samples: dome.samples,
        dim_share: if dome.dim_share.is_finite() { dome.dim_share.clamp(0.0, 1.0) } else { 0.0 },
        occludes_reflections: dome.occludes_reflections,
        has_lamps: !scene.lamps.is_empty(),
        sphere,
        casters,
    };
    refreshing.follow(&fitted, &now);
    let (chosen, ages) = refreshing.schedule.choose(dome.refreshed_per_frame.max(1), &refreshing.energies);
    state.set_if_neq(DomeState {
        casters: now.casters.len() as u32,
        redrawn: chosen.len() as u32,
        outdated: ages.outdated,
        main: ages.main,
        oldest_main: ages.oldest_main,
        key_lights: now.keys.iter().flatten().count() as u32,
        milliseconds: state.milliseconds,
    });
    refreshing.chosen = chosen;
    fitted.set_if_neq(now);
}

/// Reads back the light of the directions as long as there is something to choose between.
pub(super) fn read_energies(
    mut commands: Commands,
    mut refreshing: ResMut<Refreshing>,
    textures: Res<DomeTextures>,
    fitted: Res<FittedDome>,
    mut asked: Local<u32>,
) {
    let shadow_maps = fitted.shadow_maps();
    let is_needed = shadow_maps > 1 && refreshing.schedule.is_outdated();
    if refreshing.readback.is_some() && (!is_needed || *asked != shadow_maps) {
        if let Some(mut readback) = refreshing.readback.take().and_then(|entity| commands.get_entity(entity).ok()) {
            readback.despawn();
        }
    } else if refreshing.readback.is_none() && is_needed {
        *asked = shadow_maps;
        let size = WEIGHT_BYTES as u64 * u64::from(shadow_maps);
        let readback = commands
            .spawn(Readback::buffer_range(textures.results.clone(), 0, size))
            .observe(|answer: On<ReadbackComplete>, mut refreshing: ResMut<Refreshing>| {
                refreshing.energies = luminances(&answer.data);
            })
            .id();
        refreshing.readback = Some(readback);
    }
}

/// Returns the luminance of each light in a buffer of weights.
fn luminances(bytes: &[u8]) -> Vec<f32> {
    let of_weight = |weight: &[u8]| {
        let half = |at: usize| half::f16::from_le_bytes([weight[at], weight[at + 1]]).to_f32();
        luminance(Vec3::new(half(0), half(2), half(4)))
    };
    bytes.chunks_exact(WEIGHT_BYTES).map(of_weight).collect()
}
