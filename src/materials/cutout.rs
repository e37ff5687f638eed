//! Tells the shadow maps which surfaces are cut out by their textures.

use super::{image_based::DomeShadowed, toon::ToonShaded, twin::Dressed};
use crate::{phantom::StageRole, shadows::AlphaMask};
use bevy::{mesh::UvChannel, prelude::*};

type Dress = (
    Entity,
    Option<&'static MeshMaterial3d<StandardMaterial>>,
    Option<&'static Dressed<DomeShadowed>>,
    Option<&'static Dressed<ToonShaded>>,
    Option<&'static AlphaMask>,
);
type NewDress =
    Or<(Changed<MeshMaterial3d<StandardMaterial>>, Added<Dressed<DomeShadowed>>, Added<Dressed<ToonShaded>>)>;

pub(super) fn mark_cutouts(
    mut commands: Commands,
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    materials: Res<Assets<StandardMaterial>>,
    meshes: Query<Dress, With<StageRole>>,
    fresh: Query<(), NewDress>,
) {
    if changes.read().count() == 0 && fresh.is_empty() {
        return;
    }
    for (mesh, plain, image_based, toon, marked) in &meshes {
        let original = plain
            .map(|material| &material.0)
            .or(image_based.map(|dressed| &dressed.original))
            .or(toon.map(|dressed| &dressed.original));
        let wanted = original.and_then(|original| cutout(materials.get(original)?));
        if marked == wanted.as_ref() {
            continue;
        }
        match wanted {
            Some(cutout) => commands.entity(mesh).insert(cutout),
            None => commands.entity(mesh).remove::<AlphaMask>(),
        };
    }
}

/// How a material cuts its surfaces out, if it does.
fn cutout(material: &StandardMaterial) -> Option<AlphaMask> {
    let AlphaMode::Mask(cutoff) = material.alpha_mode else {
        return None;
    };
    Some(AlphaMask {
        texture: material.base_color_texture.clone()?,
        alpha: material.base_color.alpha(),
        cutoff,
        uv_transform: material.uv_transform,
        uses_second_uv: material.base_color_channel == UvChannel::Uv1,
    })
}
