//! Alpha masks of meshes for the shadow maps, taken from their original materials.

use super::original_material::{NewMaterial, OriginalMaterial};
use crate::{phantom::StageRole, shadows::AlphaMask};
use bevy::{mesh::UvChannel, prelude::*};

pub(super) fn mark_alpha_masks(
    mut commands: Commands,
    mut changes: MessageReader<AssetEvent<StandardMaterial>>,
    materials: Res<Assets<StandardMaterial>>,
    meshes: Query<(Entity, OriginalMaterial, Option<&AlphaMask>), With<StageRole>>,
    fresh: Query<(), NewMaterial>,
) {
    if changes.read().count() == 0 && fresh.is_empty() {
        return;
    }
    for (mesh, original, marked) in &meshes {
        let wanted = original.handle().and_then(|original| alpha_mask(materials.get(original)?));
        if marked == wanted.as_ref() {
            continue;
        }
        match wanted {
            Some(mask) => commands.entity(mesh).insert(mask),
            None => commands.entity(mesh).remove::<AlphaMask>(),
        };
    }
}

/// Returns the alpha mask of a material, if it has one with a texture.
pub(super) fn alpha_mask(material: &StandardMaterial) -> Option<AlphaMask> {
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
