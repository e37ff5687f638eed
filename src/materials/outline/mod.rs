//! Outlines of toon surfaces: the mesh once more, blown up by some pixels, seen from behind.

mod hull;
mod outline_material;
mod outlines;

pub use outline_material::OutlineMaterial;
pub(super) use {
    hull::forget_changed_hulls,
    outlines::{Outline, draw_outlines, erase_outlines},
};

use bevy::{asset::embedded_asset, prelude::*};

/// Adds the material; the systems are ordered with those of the styles.
pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "outline.wgsl");
    app.add_plugins(MaterialPlugin::<OutlineMaterial>::default())
        .init_resource::<outline_material::OutlineMaterials>()
        .init_resource::<hull::Hulls>();
}
