//! Outlines as child entities of the meshes that they surround.

use super::{
    hull::Hulls,
    outline_material::{OutlineLook, OutlineMaterial, OutlineMaterials},
};
use crate::materials::{
    SurfaceStyle, ToonMaterial, ToonShaded,
    alpha_mask::alpha_mask,
    mesh_copy::{MeshCopy, Placement, fade_tag},
    style::{OutlineFades, Styled, Styles},
};
use bevy::{light::NotShadowReceiver, mesh::MeshTag, prelude::*, render::render_resource::Face};

/// Outline of a mesh, on the mesh itself.
#[derive(Component)]
pub(in crate::materials) struct Outlined {
    outline: Entity,
    look: OutlineLook,
    hull: AssetId<Mesh>,
}

type ToonMesh = (Entity, &'static Mesh3d, &'static Styled<ToonShaded>, Option<&'static Outlined>, Placement);

/// Spawns and updates the outlines of opaque and masked toon surfaces.
pub(in crate::materials) fn draw_outlines(
    mut commands: Commands,
    mut hulls: ResMut<Hulls>,
    mut looks: ResMut<OutlineMaterials>,
    mut materials: ResMut<Assets<OutlineMaterial>>,
    mut meshes: ResMut<Assets<Mesh>>,
    originals: Res<Assets<StandardMaterial>>,
    toons: Query<ToonMesh, With<MeshMaterial3d<ToonMaterial>>>,
    mut tags: Query<&mut MeshTag, With<MeshMaterial3d<OutlineMaterial>>>,
    (styles, fades): (Styles, OutlineFades),
) {
    looks.by_look.retain(|_, material| materials.contains(*material));
    for (mesh, Mesh3d(shape), styled, outlined, placement) in &toons {
        let Some(look) = wanted_look(styles.of(mesh), originals.get(&styled.original)) else {
            continue;
        };
        let hull = hulls.around(shape, &mut meshes);
        let tag = fade_tag(fades.gone(mesh, &styles), 0.0);
        let outline = match outlined {
            Some(Outlined { outline, .. }) => *outline,
            None => commands.spawn((MeshCopy, NotShadowReceiver, tag.clone(), ChildOf(mesh))).id(),
        };
        let mut entity = commands.entity(outline);
        if outlined.is_none_or(|outlined| outlined.look != look || outlined.hull != hull.id()) {
            let existing = looks.by_look.get(&look.key()).and_then(|id| materials.get_strong_handle(*id));
            let material = existing.unwrap_or_else(|| materials.add(look.material()));
            looks.by_look.insert(look.key(), material.id());
            let hull_id = hull.id();
            entity.try_insert((Mesh3d(hull), MeshMaterial3d(material)));
            entity.commands().entity(mesh).insert(Outlined { outline, look, hull: hull_id });
        }
        placement.copy_to(&mut entity, outlined.is_none());
        if let Ok(mut shown) = tags.get_mut(outline) {
            shown.set_if_neq(tag);
        }
    }
}

/// Despawns outlines of meshes that are no longer drawn as toon surfaces with an outline.
pub(in crate::materials) fn erase_outlines(
    mut commands: Commands,
    outlined: Query<(Entity, &Outlined, Has<MeshMaterial3d<ToonMaterial>>, Option<&Styled<ToonShaded>>, Has<Mesh3d>)>,
    originals: Res<Assets<StandardMaterial>>,
    styles: Styles,
) {
    for (mesh, Outlined { outline, .. }, is_toon, styled, has_shape) in &outlined {
        let original = styled.and_then(|styled| originals.get(&styled.original));
        if !is_toon || !has_shape || wanted_look(styles.of(mesh), original).is_none() {
            commands.entity(*outline).try_despawn();
            commands.entity(mesh).remove::<Outlined>();
        }
    }
}

/// Returns the outline of a style. Transparent surfaces have none, because a hull ignores transparency.
fn wanted_look(style: SurfaceStyle, original: Option<&StandardMaterial>) -> Option<OutlineLook> {
    let (SurfaceStyle::Toon(toon), Some(original)) = (style, original) else {
        return None;
    };
    let is_solid = match original.alpha_mode {
        AlphaMode::Opaque => true,
        AlphaMode::Mask(cutoff) => original.base_color.alpha() >= cutoff,
        _ => false,
    };
    Some(OutlineLook {
        color: toon.outline_color.to_linear().with_alpha(1.0),
        widths: toon.visible_outline().filter(|_| is_solid)?,
        is_inside_out: original.cull_mode == Some(Face::Front),
        mask: alpha_mask(original),
    })
}
