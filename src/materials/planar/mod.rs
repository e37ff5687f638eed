//! Planar shadows in the picture: a rectangle over each receiver that multiplies what is drawn there.

mod overlays;
mod planar_material;

use crate::shadows::PlanarTexture;
use bevy::{asset::embedded_asset, prelude::*};
use planar_material::PlanarMaterial;

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "planar.wgsl");
    app.add_plugins(MaterialPlugin::<PlanarMaterial>::default()).add_observer(overlays::remove_overlay).add_systems(
        PostUpdate,
        overlays::lay_overlays.run_if(any_with_component::<PlanarTexture>).in_set(super::MirrorballSystems::Dress),
    );
}
