//! Exchanges the `StandardMaterial` of a mesh for a twin that extends it, as the mesh's style says.

use super::SurfaceStyle;
use crate::{
    phantom::{StageRole, nearest},
    shadows::{DomeIdentity, DomeTextures, ShadowDomeLight},
};
use bevy::{
    ecs::system::SystemParam,
    material::OpaqueRendererMethod,
    pbr::{ExtendedMaterial, MaterialExtension},
    platform::collections::{HashMap, HashSet},
    prelude::*,
};
use std::hash::Hash;

/// An extension of `StandardMaterial` that draws a style.
pub(super) trait StyleExtension: MaterialExtension {
    /// What of the style the extension depends on; meshes that agree in it share a twin.
    type Parameters: Copy + Eq + Hash + Send + Sync + 'static;

    /// `None` if this extension is not the one for the style.
    fn parameters(style: &SurfaceStyle, has_dome: bool) -> Option<Self::Parameters>;

    fn new(parameters: Self::Parameters, textures: &DomeTextures) -> Self;

    /// Takes away what the extension does not draw.
    fn simplify(base: StandardMaterial) -> StandardMaterial {
        base
    }
}

type TwinMaterial<E> = ExtendedMaterial<StandardMaterial, E>;
type TwinKey<E> = (AssetId<StandardMaterial>, <E as StyleExtension>::Parameters);

/// The twins in use; one per original and parameters, so that meshes still batch. The meshes that wear a twin keep it
/// alive.
#[derive(Resource)]
pub(super) struct Twins<E: StyleExtension> {
    by_key: HashMap<TwinKey<E>, AssetId<TwinMaterial<E>>>,
    made_with: Option<DomeIdentity>,
}

impl<E: StyleExtension> Default for Twins<E> {
    fn default() -> Self {
        Self { by_key: HashMap::default(), made_with: None }
    }
}

/// On a mesh that wears a twin: where the twin comes from.
#[derive(Component)]
pub(super) struct Dressed<E: StyleExtension> {
    pub(super) original: Handle<StandardMaterial>,
    parameters: E::Parameters,
}

/// Finds the style of a mesh.
#[derive(SystemParam)]
pub(super) struct Styles<'w, 's> {
    parents: Query<'w, 's, &'static ChildOf>,
    styles: Query<'w, 's, &'static SurfaceStyle>,
    domes: Query<'w, 's, (), With<ShadowDomeLight>>,
}

impl Styles<'_, '_> {
    pub(super) fn of(&self, mesh: Entity) -> SurfaceStyle {
        nearest(mesh, &self.parents, &self.styles).copied().unwrap_or_default()
    }

    fn parameters<E: StyleExtension>(&self, mesh: Entity) -> Option<E::Parameters> {
        E::parameters(&self.of(mesh), !self.domes.is_empty())
    }
}

/// The twin of a material. Always drawn forward: the deferred pass knows no shadow per color channel.
fn twin<E: StyleExtension>(
    original: &StandardMaterial,
    parameters: E::Parameters,
    textures: &DomeTextures,
) -> TwinMaterial<E> {
    let base = StandardMaterial { opaque_render_method: OpaqueRendererMethod::Forward, ..original.clone() };
    ExtendedMaterial { base: E::simplify(base), extension: E::new(parameters, textures) }
}

/// Copies changes of the originals and of the dome's textures into the twins.
pub(super) fn follow_changes<E: StyleExtension>(
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    mut twins: ResMut<Twins<E>>,
    mut materials: ResMut<Assets<TwinMaterial<E>>>,
    originals: Res<Assets<StandardMaterial>>,
    textures: Res<DomeTextures>,
) {
    let textures_changed = twins.made_with.replace(textures.identity()) != Some(textures.identity());
    let modified = |event: &AssetEvent<StandardMaterial>| match event {
        AssetEvent::Modified { id } => Some(*id),
        _ => None,
    };
    let changed: HashSet<_> = changes.read().filter_map(modified).collect();
    if textures_changed || !changed.is_empty() {
        for ((id, parameters), material) in &twins.by_key {
            let Some(original) = originals.get(*id).filter(|_| textures_changed || changed.contains(id)) else {
                continue;
            };
            if let Some(mut material) = materials.get_mut(*material) {
                *material = twin(original, *parameters, &textures);
            }
        }
    }
    twins.by_key.retain(|_, material| materials.contains(*material));
}

type DressedMesh<E> = (Entity, &'static Dressed<E>);

/// Gives meshes their original back when their style has changed.
pub(super) fn release_materials<E: StyleExtension>(
    mut commands: Commands,
    meshes: Query<DressedMesh<E>, With<MeshMaterial3d<TwinMaterial<E>>>>,
    styles: Styles,
) {
    for (mesh, dressed) in &meshes {
        if styles.parameters::<E>(mesh) != Some(dressed.parameters) {
            commands
                .entity(mesh)
                .remove::<(MeshMaterial3d<TwinMaterial<E>>, Dressed<E>)>()
                .insert(MeshMaterial3d(dressed.original.clone()));
        }
    }
}

type PlainMesh = (Entity, &'static MeshMaterial3d<StandardMaterial>, &'static StageRole);

/// Dresses plain meshes whose style this extension draws.
pub(super) fn adopt_materials<E: StyleExtension>(
    mut commands: Commands,
    mut twins: ResMut<Twins<E>>,
    mut materials: ResMut<Assets<TwinMaterial<E>>>,
    originals: Res<Assets<StandardMaterial>>,
    textures: Res<DomeTextures>,
    meshes: Query<PlainMesh>,
    styles: Styles,
) {
    for (mesh, material, role) in &meshes {
        if *role != StageRole::Virtual {
            continue;
        }
        let Some(parameters) = styles.parameters::<E>(mesh) else {
            continue;
        };
        let Some(original) = originals.get(&material.0) else {
            continue;
        };
        let key = (material.id(), parameters);
        let existing = twins.by_key.get(&key).and_then(|id| materials.get_strong_handle(*id));
        let handle = existing.unwrap_or_else(|| materials.add(twin(original, parameters, &textures)));
        twins.by_key.insert(key, handle.id());
        commands
            .entity(mesh)
            .remove::<MeshMaterial3d<StandardMaterial>>()
            .insert((MeshMaterial3d(handle), Dressed::<E> { original: material.0.clone(), parameters }));
    }
}
