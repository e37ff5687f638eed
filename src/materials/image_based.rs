//! `StandardMaterial` whose image-based light is shadowed by the dome.

use crate::{
    shadows::{DomeTextures, ShadowDomeLight},
    stage::{StageRole, nearest},
};
use bevy::{
    material::OpaqueRendererMethod,
    pbr::{ExtendedMaterial, MaterialExtension},
    platform::collections::HashMap,
    prelude::*,
    render::{render_resource::AsBindGroup, storage::ShaderBuffer},
    shader::ShaderRef,
};

/// How a mesh, or everything below a spawned scene's root, is shaded. The nearest ancestor's style counts.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Component, Default, Debug, Clone, PartialEq, Hash)]
#[non_exhaustive]
pub enum SurfaceStyle {
    /// Lit by the measured environment, with dome shadows on its diffuse light. What meshes without a style get.
    #[default]
    ImageBased,
    /// Bevy's `StandardMaterial` untouched: lit by the environment, without dome shadows.
    Engine,
}

/// A `StandardMaterial` under dome shadows.
pub type ImageBasedMaterial = ExtendedMaterial<StandardMaterial, DomeShadowed>;

/// What [`ImageBasedMaterial`] adds to a `StandardMaterial`. Managed by the crate.
#[derive(Asset, AsBindGroup, TypePath, Clone, Debug)]
pub struct DomeShadowed {
    #[texture(100, sample_type = "depth")]
    #[sampler(101, sampler_type = "comparison")]
    atlas: Handle<Image>,
    #[storage(102, read_only)]
    views: Handle<ShaderBuffer>,
    #[storage(103, read_only)]
    weights: Handle<ShaderBuffer>,
}

impl From<&DomeTextures> for DomeShadowed {
    fn from(textures: &DomeTextures) -> Self {
        Self { atlas: textures.atlas.clone(), views: textures.views.clone(), weights: textures.weights.clone() }
    }
}

impl MaterialExtension for DomeShadowed {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_mirrorball/materials/image_based.wgsl".into()
    }
}

/// The twin of a material. Always drawn forward: the deferred pass knows no shadow per color channel.
fn extend(original: &StandardMaterial, textures: &DomeTextures) -> ImageBasedMaterial {
    let base = StandardMaterial { opaque_render_method: OpaqueRendererMethod::Forward, ..original.clone() };
    ImageBasedMaterial { base, extension: textures.into() }
}

/// The extended twin of each `StandardMaterial` in use; one per original, so that meshes still batch.
#[derive(Resource, Default)]
pub(super) struct ExtendedMaterials {
    by_original: HashMap<AssetId<StandardMaterial>, Handle<ImageBasedMaterial>>,
    atlas: Option<AssetId<Image>>,
}

/// The `StandardMaterial` a mesh came with.
#[derive(Component, Clone, Debug)]
pub(super) struct OriginalMaterial(Handle<StandardMaterial>);

pub(super) fn follow_changes(
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    mut twins: ResMut<ExtendedMaterials>,
    mut extended: ResMut<Assets<ImageBasedMaterial>>,
    originals: Res<Assets<StandardMaterial>>,
    textures: Res<DomeTextures>,
) {
    let atlas_changed = twins.atlas.replace(textures.atlas.id()) != Some(textures.atlas.id());
    let changed: Vec<_> = changes
        .read()
        .filter_map(|event| match event {
            AssetEvent::Modified { id } => Some(*id),
            _ => None,
        })
        .collect();
    for (id, twin) in &twins.by_original {
        if !atlas_changed && !changed.contains(id) {
            continue;
        }
        if let (Some(original), Some(mut twin)) = (originals.get(*id), extended.get_mut(twin)) {
            *twin = extend(original, &textures);
        }
    }
    // A twin nobody else holds on to goes with its original.
    twins.by_original.retain(|id, _| originals.contains(*id));
}

type PlainMesh = (Entity, &'static MeshMaterial3d<StandardMaterial>, &'static StageRole);

pub(super) fn adopt_materials(
    mut commands: Commands,
    mut twins: ResMut<ExtendedMaterials>,
    mut extended: ResMut<Assets<ImageBasedMaterial>>,
    originals: Res<Assets<StandardMaterial>>,
    textures: Res<DomeTextures>,
    domes: Query<(), With<ShadowDomeLight>>,
    meshes: Query<PlainMesh>,
    parents: Query<&ChildOf>,
    styles: Query<&SurfaceStyle>,
) {
    if domes.is_empty() {
        return;
    }
    for (mesh, material, role) in &meshes {
        let style = nearest(mesh, &parents, &styles).copied().unwrap_or_default();
        if *role != StageRole::Virtual || style != SurfaceStyle::ImageBased {
            continue;
        }
        let Some(original) = originals.get(&material.0) else {
            continue;
        };
        let twin = twins.by_original.entry(material.id()).or_insert_with(|| extended.add(extend(original, &textures)));
        commands
            .entity(mesh)
            .remove::<MeshMaterial3d<StandardMaterial>>()
            .insert((MeshMaterial3d(twin.clone()), OriginalMaterial(material.0.clone())));
    }
}

type AdoptedMesh = (Entity, &'static OriginalMaterial);

pub(super) fn release_materials(
    mut commands: Commands,
    meshes: Query<AdoptedMesh, With<MeshMaterial3d<ImageBasedMaterial>>>,
    domes: Query<(), With<ShadowDomeLight>>,
    parents: Query<&ChildOf>,
    styles: Query<&SurfaceStyle>,
) {
    for (mesh, original) in &meshes {
        let style = nearest(mesh, &parents, &styles).copied().unwrap_or_default();
        if domes.is_empty() || style != SurfaceStyle::ImageBased {
            commands
                .entity(mesh)
                .remove::<(MeshMaterial3d<ImageBasedMaterial>, OriginalMaterial)>()
                .insert(MeshMaterial3d(original.0.clone()));
        }
    }
}
