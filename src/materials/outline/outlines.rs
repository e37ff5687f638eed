//! Outlines as child entities of the meshes that they surround.

use super::{
    hull::Hulls,
    outline_material::{OutlineLook, OutlineMaterial, OutlineMaterials},
};
use crate::materials::{
    SurfaceStyle, ToonMaterial, ToonShaded,
    alpha_mask::alpha_mask,
    style::{Styled, Styles},
};
use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange},
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{morph::MeshMorphWeights, skinning::SkinnedMesh},
    prelude::*,
    render::render_resource::Face,
};

/// Marker of the child entity that draws the outline of its parent. As a child it moves and despawns with the mesh.
#[derive(Component)]
pub(in crate::materials) struct Outline;

/// Outline of a mesh, on the mesh itself.
#[derive(Component)]
pub(in crate::materials) struct Outlined {
    outline: Entity,
    look: OutlineLook,
    hull: AssetId<Mesh>,
}

type ToonMesh = (
    Entity,
    &'static Mesh3d,
    &'static Styled<ToonShaded>,
    Option<&'static Outlined>,
    (
        Option<Ref<'static, SkinnedMesh>>,
        Option<Ref<'static, MeshMorphWeights>>,
        Option<Ref<'static, RenderLayers>>,
        Option<Ref<'static, VisibilityRange>>,
        Option<Ref<'static, NoFrustumCulling>>,
    ),
);

/// Spawns and updates the outlines of opaque and masked toon surfaces.
pub(in crate::materials) fn draw_outlines(
    mut commands: Commands,
    mut hulls: ResMut<Hulls>,
    mut looks: ResMut<OutlineMaterials>,
    mut materials: ResMut<Assets<OutlineMaterial>>,
    mut meshes: ResMut<Assets<Mesh>>,
    originals: Res<Assets<StandardMaterial>>,
    toons: Query<ToonMesh, With<MeshMaterial3d<ToonMaterial>>>,
    styles: Styles,
) {
    looks.by_look.retain(|_, material| materials.contains(*material));
    for (mesh, Mesh3d(shape), styled, outlined, (skin, morph, layers, range, unculled)) in &toons {
        let Some(look) = wanted_look(styles.of(mesh), originals.get(&styled.original)) else {
            continue;
        };
        let hull = hulls.around(shape, &mut meshes);
        let outline = match outlined {
            Some(Outlined { outline, .. }) => *outline,
            None => commands.spawn((Outline, NotShadowCaster, NotShadowReceiver, ChildOf(mesh))).id(),
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
        // Skins, morph weights, layers and visibility ranges apply to the outline as to the mesh.
        let is_new = outlined.is_none();
        if let Some(skin) = skin.filter(|skin| is_new || skin.is_changed()) {
            entity.try_insert(SkinnedMesh::clone(&skin));
        }
        if let Some(morph) = morph.filter(|morph| is_new || morph.is_changed()) {
            entity.try_insert(MeshMorphWeights::clone(&morph));
        }
        if let Some(layers) = layers.filter(|layers| is_new || layers.is_changed()) {
            entity.try_insert(RenderLayers::clone(&layers));
        }
        if let Some(range) = range.filter(|range| is_new || range.is_changed()) {
            entity.try_insert(VisibilityRange::clone(&range));
        }
        if unculled.is_some_and(|unculled| is_new || unculled.is_added()) {
            entity.try_insert(NoFrustumCulling);
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
