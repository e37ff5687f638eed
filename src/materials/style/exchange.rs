//! Exchange of the `StandardMaterial`s of meshes for styled materials, and back.

use super::{
    MeasuredLightWeight, SurfaceStyle,
    style_fade::FadingStyle,
    styled_materials::{
        Look, MeshContext, SharedBindings, StyleExtension, Styled, StyledMaterial, StyledMaterials, styled_material,
    },
};
use crate::{
    materials::toon::{RampImages, ToonRamps},
    phantom::{StageRole, nearest},
    shadows::{Lamp, ShadowDomeLight},
};
use bevy::{ecs::system::SystemParam, platform::collections::HashSet, prelude::*};

/// System parameter that looks up the style of a mesh.
#[derive(SystemParam)]
pub(in crate::materials) struct Styles<'w, 's> {
    parents: Query<'w, 's, &'static ChildOf>,
    styles: Query<'w, 's, &'static SurfaceStyle>,
    fading: Query<'w, 's, &'static FadingStyle>,
    domes: Query<'w, 's, (), With<ShadowDomeLight>>,
    lamps: Query<'w, 's, (), Lamp>,
    weights: Query<'w, 's, &'static MeasuredLightWeight>,
    ramps: Query<'w, 's, &'static ToonRamps>,
    ramp_images: Res<'w, RampImages>,
}

impl Styles<'_, '_> {
    pub(in crate::materials) fn of(&self, mesh: Entity) -> SurfaceStyle {
        match self.fading.get(mesh) {
            Ok(fading) => fading.style,
            Err(_) => nearest(mesh, &self.parents, &self.styles).copied().unwrap_or_default(),
        }
    }

    fn look<E: StyleExtension>(&self, mesh: Entity) -> Option<Look<E>> {
        let style = self.of(mesh);
        let weight = nearest(mesh, &self.parents, &self.weights).copied().unwrap_or_default();
        let ramps = matches!(style, SurfaceStyle::Toon(_)).then(|| nearest(mesh, &self.parents, &self.ramps));
        let context = MeshContext {
            fades: self.fading.contains(mesh),
            has_dome: !self.domes.is_empty(),
            has_lamps: !self.lamps.is_empty(),
            measured_light: weight.clamped(),
            ramps: ramps.flatten().map(|ramps| self.ramp_images.pair(ramps)).unwrap_or_default(),
        };
        Some((E::parameters(&style, context)?, context.fades))
    }
}

/// Copies changes of the originals and of the shared bindings into the styled materials.
pub(in crate::materials) fn update_styled_materials<E: StyleExtension>(
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    mut styled_materials: ResMut<StyledMaterials<E>>,
    mut materials: ResMut<Assets<StyledMaterial<E>>>,
    originals: Res<Assets<StandardMaterial>>,
    shared: SharedBindings,
) {
    let identity = shared.identity();
    let bindings_changed = styled_materials.made_with.replace(identity) != Some(identity);
    let modified = |event: &AssetEvent<StandardMaterial>| match event {
        AssetEvent::Modified { id } => Some(*id),
        _ => None,
    };
    let changed: HashSet<_> = changes.read().filter_map(modified).collect();
    if bindings_changed || !changed.is_empty() {
        for ((id, look), material) in &styled_materials.by_key {
            let Some(original) = originals.get(*id).filter(|_| bindings_changed || changed.contains(id)) else {
                continue;
            };
            if let Some(mut material) = materials.get_mut(*material) {
                *material = styled_material(original, *look, &shared);
            }
        }
    }
    styled_materials.by_key.retain(|_, material| materials.contains(*material));
}

type StyledMesh<E> = (Entity, &'static Styled<E>);

/// Restores the original materials of meshes whose style has changed.
pub(in crate::materials) fn restore_originals<E: StyleExtension>(
    mut commands: Commands,
    meshes: Query<StyledMesh<E>, With<MeshMaterial3d<StyledMaterial<E>>>>,
    styles: Styles,
) {
    for (mesh, styled) in &meshes {
        if styles.look::<E>(mesh) != Some(styled.look) {
            commands
                .entity(mesh)
                .remove::<(MeshMaterial3d<StyledMaterial<E>>, Styled<E>)>()
                .insert(MeshMaterial3d(styled.original.clone()));
        }
    }
}

type PlainMesh = (Entity, &'static MeshMaterial3d<StandardMaterial>, &'static StageRole);

/// Puts styled materials on virtual meshes whose style this extension draws.
pub(in crate::materials) fn apply_styles<E: StyleExtension>(
    mut commands: Commands,
    mut styled_materials: ResMut<StyledMaterials<E>>,
    mut materials: ResMut<Assets<StyledMaterial<E>>>,
    originals: Res<Assets<StandardMaterial>>,
    shared: SharedBindings,
    meshes: Query<PlainMesh>,
    styles: Styles,
) {
    for (mesh, material, role) in &meshes {
        if *role != StageRole::Virtual {
            continue;
        }
        let Some(look) = styles.look::<E>(mesh) else {
            continue;
        };
        let Some(original) = originals.get(&material.0) else {
            continue;
        };
        let key = (material.id(), look);
        let existing = styled_materials.by_key.get(&key).and_then(|id| materials.get_strong_handle(*id));
        let handle = existing.unwrap_or_else(|| materials.add(styled_material(original, look, &shared)));
        styled_materials.by_key.insert(key, handle.id());
        commands
            .entity(mesh)
            .remove::<MeshMaterial3d<StandardMaterial>>()
            .insert((MeshMaterial3d(handle), Styled::<E> { original: material.0.clone(), look }));
    }
}
