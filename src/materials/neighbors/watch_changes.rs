//! Changes after which mirrors have to be rendered again.

use super::neighbor_probe::{FACES, NeighborProbe};
use crate::{
    camera::{ArCamera, CameraFrame},
    materials::{ClassicMaterial, ImageBasedMaterial, ToonMaterial},
    phantom::StageRole,
    prefilter::EnvironmentState,
    shadows::{DomeState, ShadowDomeLight},
};
use bevy::{
    camera::Exposure,
    ecs::{entity::EntityHashMap, system::SystemParam},
    mesh::{MeshTag, morph::MeshMorphWeights},
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        render_resource::{CachedPipelineState, PipelineCache},
    },
};
use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

pub(super) fn build(app: &mut App) {
    let compiled = CompiledPipelines::default();
    app.insert_resource(compiled.clone());
    if let Some(render_app) = app.get_sub_app_mut(RenderApp) {
        render_app.insert_resource(compiled).add_systems(Render, count_pipelines.in_set(RenderSystems::Cleanup));
    }
}

/// Number of compiled pipelines, written by the render world: before all are there, faces lack what they draw.
#[derive(Resource, Clone, Default)]
pub(super) struct CompiledPipelines(Arc<AtomicUsize>);

fn count_pipelines(compiled: Res<CompiledPipelines>, cache: Res<PipelineCache>) {
    let count = cache.pipelines().filter(|pipeline| matches!(pipeline.state, CachedPipelineState::Ok(_))).count();
    compiled.0.store(count, Ordering::Relaxed);
}

/// Any thing but a camera or a probe whose place was written, joints of skins too.
type Placed = (Changed<GlobalTransform>, Without<Camera>, Without<NeighborProbe>);
type ChangedMesh = Or<(
    Changed<Mesh3d>,
    Changed<StageRole>,
    Changed<InheritedVisibility>,
    Changed<MeshMorphWeights>,
    Changed<MeshTag>,
    Changed<MeshMaterial3d<StandardMaterial>>,
    Changed<MeshMaterial3d<ImageBasedMaterial>>,
    Changed<MeshMaterial3d<ToonMaterial>>,
    Changed<MeshMaterial3d<ClassicMaterial>>,
)>;
type ChangedLight = Or<(Changed<PointLight>, Changed<SpotLight>, Changed<DirectionalLight>, Changed<ShadowDomeLight>)>;
type ChangedCamera = Or<(Changed<CameraFrame>, Changed<Exposure>, Changed<AmbientLight>, Changed<ArCamera>)>;
type PlacedCamera = (With<ArCamera>, Changed<GlobalTransform>);
type Placement = (Entity, &'static GlobalTransform);

/// Last places of what has moved: games write equal places too.
#[derive(Default)]
pub(super) struct Places(EntityHashMap<GlobalTransform>);

impl Places {
    /// Keeps the places, and returns whether one is new.
    fn update<'a>(&mut self, placed: impl Iterator<Item = (Entity, &'a GlobalTransform)>) -> bool {
        let mut has_moved = false;
        for (entity, place) in placed {
            has_moved |= self.0.insert(entity, *place) != Some(*place);
        }
        has_moved
    }
}

/// What mirrors show.
#[derive(SystemParam)]
pub(super) struct Surroundings<'w, 's> {
    placed: Query<'w, 's, Placement, Placed>,
    placed_cameras: Query<'w, 's, Placement, PlacedCamera>,
    places: Local<'s, Places>,
    unplaced: RemovedComponents<'w, 's, GlobalTransform>,
    meshes: Query<'w, 's, (), (With<Mesh3d>, ChangedMesh)>,
    lights: Query<'w, 's, (), ChangedLight>,
    cameras: Query<'w, 's, (), (With<ArCamera>, ChangedCamera)>,
    environments: Query<'w, 's, &'static EnvironmentState, With<ArCamera>>,
    domes: Query<'w, 's, &'static DomeState>,
    removed: RemovedComponents<'w, 's, Mesh3d>,
    changed_meshes: MessageReader<'w, 's, AssetEvent<Mesh>>,
    changed_materials: MessageReader<'w, 's, AssetEvent<StandardMaterial>>,
    compiled: Res<'w, CompiledPipelines>,
}

/// Counters of what has no change detection.
#[derive(Default, PartialEq)]
pub(super) struct Counts {
    pipelines: usize,
    refreshes: Vec<u32>,
    key_lights: Vec<u32>,
}

impl Surroundings<'_, '_> {
    fn counts(&self) -> Counts {
        let refreshes = |state: &EnvironmentState| match state {
            EnvironmentState::Live { refreshes, .. } => *refreshes,
            _ => 0,
        };
        Counts {
            pipelines: self.compiled.0.load(Ordering::Relaxed),
            refreshes: self.environments.iter().map(refreshes).collect(),
            key_lights: self.domes.iter().map(|dome| dome.key_lights).collect(),
        }
    }

    fn have_changed(&mut self) -> bool {
        for entity in self.unplaced.read() {
            self.places.0.remove(&entity);
        }
        let has_moved = self.places.update(self.placed.iter().chain(&self.placed_cameras));
        // All readers are read to their ends.
        let has_removed = self.removed.read().count() > 0;
        let has_changed_mesh = self.changed_meshes.read().count() > 0;
        let has_changed_material = self.changed_materials.read().count() > 0;
        has_removed
            || has_changed_mesh
            || has_changed_material
            || has_moved
            || !self.meshes.is_empty()
            || !self.lights.is_empty()
            || !self.cameras.is_empty()
            || self.domes.iter().any(|dome| dome.outdated > 0 || dome.redrawn > 0)
    }
}

/// Schedules another round of faces for all probes when something changes; two if they see each other.
pub(super) fn watch_changes(
    mut surroundings: Surroundings,
    mut probes: Query<&mut NeighborProbe>,
    mut last: Local<Counts>,
) {
    let counts = surroundings.counts();
    let has_changed = surroundings.have_changed() | (counts != *last);
    *last = counts;
    if has_changed {
        let rounds = probes.iter().len().min(2) as u32;
        for mut probe in &mut probes {
            // A round that has begun ends first, because only whole ones are filtered.
            probe.faces_left = probe.faces_left % FACES + rounds * FACES;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_new_places_count() {
        let mut world = World::new();
        let (a, b) = (world.spawn_empty().id(), world.spawn_empty().id());
        let (here, there) = (GlobalTransform::IDENTITY, GlobalTransform::from_xyz(1.0, 0.0, 0.0));
        let mut places = Places::default();
        assert!(places.update([(a, &here), (b, &here)].into_iter()));
        assert!(!places.update([(a, &here), (b, &here)].into_iter()), "the same again");
        assert!(places.update([(a, &here), (b, &there)].into_iter()));
        assert!(!places.update(std::iter::empty()));
    }
}
