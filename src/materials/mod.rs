//! How entities look: phantoms, image-based surfaces.
//!
//! **Enters:** [`StageRole`](crate::stage::StageRole) and [`SurfaceStyle`] of meshes, the dome's textures, the camera's
//! picture. **Leaves:** materials that show phantoms as the camera picture under virtual shadows, and `StandardMaterial`s
//! whose image-based light is shadowed by the dome.
//!
//! A mesh's `StandardMaterial` is exchanged for an [`ImageBasedMaterial`] that extends it; changes of the original asset are
//! followed. [`SurfaceStyle::Engine`] keeps or brings back the original.

mod image_based;
mod phantom;

pub use image_based::{DomeShadowed, ImageBasedMaterial, SurfaceStyle};
pub use phantom::PhantomMaterial;

use crate::{
    MirrorballSystems,
    shadows::{DomeTextures, ShadowsPlugin},
};
use bevy::{asset::embedded_asset, prelude::*};

/// Puts the crate's materials on meshes.
pub struct MaterialsPlugin;

impl Plugin for MaterialsPlugin {
    fn build(&self, app: &mut App) {
        // Their shaders import the dome's, with or without a dome in the scene.
        if !app.is_plugin_added::<ShadowsPlugin>() {
            app.add_plugins(ShadowsPlugin);
        }
        embedded_asset!(app, "phantom.wgsl");
        embedded_asset!(app, "image_based.wgsl");
        app.register_type::<SurfaceStyle>()
            .add_plugins((
                MaterialPlugin::<PhantomMaterial>::default(),
                MaterialPlugin::<ImageBasedMaterial>::default(),
            ))
            .init_resource::<image_based::ExtendedMaterials>()
            .init_resource::<phantom::PhantomMaterials>()
            .add_systems(
                PostUpdate,
                (
                    phantom::follow_camera,
                    phantom::dress_phantoms,
                    image_based::follow_changes,
                    image_based::adopt_materials,
                    image_based::release_materials,
                )
                    .chain()
                    // Without a renderer there is nothing to dress.
                    .run_if(resource_exists::<DomeTextures>)
                    .after(crate::stage::assign_roles)
                    .before(MirrorballSystems::Measure)
                    .before(bevy::asset::AssetEventSystems),
            );
    }
}
