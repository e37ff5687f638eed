//! Child entities that draw the mesh of their parent once more: outlines, and styles that fade out.

use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers, VisibilityRange},
    ecs::query::QueryData,
    light::{NotShadowCaster, NotShadowReceiver},
    mesh::{MeshTag, morph::MeshMorphWeights, skinning::SkinnedMesh},
    prelude::*,
};

/// Marker of a child entity that draws the mesh of its parent once more. As a child it moves and despawns with the
/// mesh.
#[derive(Component)]
#[require(NotShadowCaster)]
pub(crate) struct MeshCopy;

/// Components of a mesh that apply to its copies as well.
#[derive(QueryData)]
pub(super) struct Placement {
    skin: Option<Ref<'static, SkinnedMesh>>,
    morph: Option<Ref<'static, MeshMorphWeights>>,
    layers: Option<Ref<'static, RenderLayers>>,
    range: Option<Ref<'static, VisibilityRange>>,
    unculled: Option<Ref<'static, NoFrustumCulling>>,
    unshadowed: Option<Ref<'static, NotShadowReceiver>>,
}

impl PlacementItem<'_, '_> {
    /// Gives a copy what is new or has changed.
    pub(super) fn copy_to(&self, copy: &mut EntityCommands, is_new: bool) {
        if let Some(skin) = self.skin.as_ref().filter(|skin| is_new || skin.is_changed()) {
            copy.try_insert(SkinnedMesh::clone(skin));
        }
        if let Some(morph) = self.morph.as_ref().filter(|morph| is_new || morph.is_changed()) {
            copy.try_insert(MeshMorphWeights::clone(morph));
        }
        if let Some(layers) = self.layers.as_ref().filter(|layers| is_new || layers.is_changed()) {
            copy.try_insert(RenderLayers::clone(layers));
        }
        if let Some(range) = self.range.as_ref().filter(|range| is_new || range.is_changed()) {
            copy.try_insert(VisibilityRange::clone(range));
        }
        if self.unculled.as_ref().is_some_and(|unculled| is_new || unculled.is_added()) {
            copy.try_insert(NoFrustumCulling);
        }
        if self.unshadowed.as_ref().is_some_and(|unshadowed| is_new || unshadowed.is_added()) {
            copy.try_insert(NotShadowReceiver);
        }
    }
}

/// Returns the tag by which shaders know how much of a copy is gone, and below which alpha its mask cuts out, both 0…1.
/// Without a tag, all of a mesh is there.
pub(super) fn fade_tag(gone: f32, cutoff: f32) -> MeshTag {
    let unorm = |number: f32| (number.clamp(0.0, 1.0) * f32::from(u16::MAX)).round() as u32;
    MeshTag(unorm(gone) | unorm(cutoff) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_hold_both_numbers() {
        assert_eq!(fade_tag(0.0, 0.0).0, MeshTag::default().0);
        assert_eq!(fade_tag(1.0, 0.0).0, 0xffff);
        assert_eq!(fade_tag(0.5, 7.0).0, 0xffff_8000);
        assert_eq!(fade_tag(-1.0, 0.5).0, 0x8000_0000);
    }
}
