//! The material that a mesh was given, whatever its style draws it with.

use super::{classic::ClassicShaded, image_based::DomeShadowed, style::Styled, toon::ToonShaded};
use bevy::{ecs::query::QueryData, prelude::*};

#[derive(QueryData)]
pub(super) struct OriginalMaterial {
    plain: Option<&'static MeshMaterial3d<StandardMaterial>>,
    image_based: Option<&'static Styled<DomeShadowed>>,
    toon: Option<&'static Styled<ToonShaded>>,
    classic: Option<&'static Styled<ClassicShaded>>,
}

/// Filter for meshes whose material may be another one than before.
pub(super) type NewMaterial = Or<(
    Changed<MeshMaterial3d<StandardMaterial>>,
    Added<Styled<DomeShadowed>>,
    Added<Styled<ToonShaded>>,
    Added<Styled<ClassicShaded>>,
)>;

impl<'w> OriginalMaterialItem<'w, '_> {
    /// `None` for a mesh with a material that is no `StandardMaterial`.
    pub(super) fn handle(&self) -> Option<&'w Handle<StandardMaterial>> {
        let image_based = self.image_based.map(|styled| &styled.original);
        let toon = self.toon.map(|styled| &styled.original);
        let classic = self.classic.map(|styled| &styled.original);
        self.plain.map(|material| &material.0).or(image_based).or(toon).or(classic)
    }
}
