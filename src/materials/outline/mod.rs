//! Outlines of toon surfaces: back faces of the mesh, enlarged by a number of pixels and meters ("inverted hull").
//!
//! **Enters:** meshes with a [`ToonMaterial`](super::ToonMaterial) and the style that they inherit. **Leaves:** a
//! child entity for each outline, which draws the hull of the mesh with an [`OutlineMaterial`].

mod hull;
mod outline_material;
mod outlines;

pub use outline_material::OutlineMaterial;
pub(super) use {
    hull::forget_changed_hulls,
    outlines::{draw_outlines, erase_outlines},
};

use bevy::{asset::embedded_asset, prelude::*};

/// Adds the material and its resources. `MaterialsPlugin` adds the systems, in order with those of the styles.
pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "outline.wgsl");
    app.add_plugins(MaterialPlugin::<OutlineMaterial>::default())
        .init_resource::<outline_material::OutlineMaterials>()
        .init_resource::<hull::Hulls>();
}
