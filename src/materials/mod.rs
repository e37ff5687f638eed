//! How entities look: phantoms, image-based surfaces, toons.
//!
//! **Enters:** [`StageRole`](crate::phantom::StageRole) and [`SurfaceStyle`] of meshes, the dome's textures, the
//! camera's picture. **Leaves:** materials that show phantoms as the camera picture under virtual shadows, and
//! `StandardMaterial`s whose image-based light is shadowed by the dome, smoothly or in the flat bands of a cartoon.
//!
//! A mesh's `StandardMaterial` is exchanged for an [`ImageBasedMaterial`] or a [`ToonMaterial`] that extends it;
//! changes of the original asset are followed. [`SurfaceStyle::Engine`] keeps or brings back the original. Styles may
//! change at any time.
//!
//! # Virtual lamps on real things
//! Bevy's point, spot and directional lights fall on phantoms that receive: camera picture × (visibility ratio + `E_lamp` ÷
//! `E_real`). Whatever the surface's color is, it is in the picture already. `E_lamp` is the irradiance from the lamps past
//! what is in their shadow maps, virtual things and phantoms; `E_real` what the environment map gives there, past phantoms in
//! the dome. Both have Bevy's units: a lamp of π lux doubles the picture where the map, at an intensity of 1, is 1.0. Without
//! an environment map on the camera there is nothing to compare lamps with, and they light virtual things only.
//!
//! Scenes without lamps have pipelines without them. What phantoms leave of the room's light to each other is found in the
//! visibility pass, as brightness. Lamps count as points, textures of lights and rectangle lights do nothing here, and light that lamps throw from thing to
//! thing is left out, as it is on virtual surfaces.
//!
//! # Edges of phantoms
//! Virtual things end where a phantom hides them, as sharply as pixels allow. [`SoftPhantomEdges`] on the camera lets the two fade
//! into each other instead.
//!
//! # Toon
//! A cartoon has its bands from the room: with E(n) = light that a white matte surface facing n gets at this place
//! (environment, lamps and ambient light together), the direction l from which light prevails, and the surface's
//! normal N,
//! - position = (E(N) under all shadows − E(−l)) ÷ (E(l) − E(−l)), in luminance, is cut into b bands of equal width;
//! - color = base color × mix(E(−l), E(l), level of the band) + emissive. The highest band has level 1, the lowest
//!   1/2b, the middle of its range, so that no form sinks into black.
//!
//! The lit side has the color of the light (and the brightness of white paper that faces it), the dark side that of
//! the fill, and a shadow drops a surface by some bands. The irradiance at n minus that at −n is exactly n · (light
//! vector) (Gershun 1936), so l comes from six evaluations of the engine's lighting. In evenly lit rooms contrast is
//! raised as a draftsman would: the range E(l) − E(−l) counts at least 30 % of E(l), and the dark color has at
//! most 45 % of it.
//!
//! Glossy surfaces have a highlight, a spot in the color of the light where they would mirror l, larger and fainter
//! the rougher they are; none in the lowest band and none where light comes from everywhere. Base color, its texture,
//! vertex colors, normal map, alpha and emissive are kept; metalness, coats and transmission are not drawn. Edges are
//! one pixel wide. Without any light a toon is black.
//!
//! The outline is a child entity that draws the mesh's far side, moved outwards by a number of pixels. Hard edges are
//! closed by merging the normals at one place, where the mesh's data is still on the CPU (elsewhere lines have gaps
//! there); the line beside a right-angled edge is up to 30 % thinner. It has the depth of the mesh, so it is hidden
//! where the mesh touches something nearer to the camera, such as the desk it stands on. Transparent and masked
//! surfaces have no outline, and neither have meshes without normals.
//!
//! Cost: nine evaluations of the engine's light per pixel (one of them with shadow maps), each one texture lookup for
//! the environment and a loop over the lamps, and the dome's shadows once. An outline draws the mesh's triangles
//! again.
//!
//! Limits: beside a lamp the bands follow its falloff with distance and are not flat. All bands lie between two
//! colors, so of two lamps of different color each side shows the mixture. Dome shadows see toons in their rest pose,
//! as everything.
//!
//! Sources: Kunze 2006 (rows E1–E3), who takes ramps of two to five levels over N·L and R·V of one lamp from textures,
//! draws back faces in black lines, and switches the style per model.

mod alpha_mask;
mod dome_bindings;
mod image_based;
mod outline;
mod phantom;
mod soft_edges;
mod style;
mod toon;

pub use image_based::{DomeShadowed, ImageBasedMaterial};
pub use outline::OutlineMaterial;
pub use phantom::PhantomMaterial;
pub use soft_edges::SoftPhantomEdges;
pub use style::{SurfaceStyle, ToonStyle};
pub use toon::{ToonMaterial, ToonShaded};

use crate::{
    MirrorballSystems,
    shadows::{DomeTextures, ShadowsPlugin},
};
use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

/// Puts the crate's materials on meshes.
pub struct MaterialsPlugin;

impl Plugin for MaterialsPlugin {
    fn build(&self, app: &mut App) {
        crate::schedule::configure(app);
        // Their shaders import the dome's, with or without a dome in the scene.
        if !app.is_plugin_added::<ShadowsPlugin>() {
            app.add_plugins(ShadowsPlugin);
        }
        load_shader_library!(app, "lamps.wgsl");
        load_shader_library!(app, "phantom_frame.wgsl");
        embedded_asset!(app, "phantom.wgsl");
        embedded_asset!(app, "phantom_prepass.wgsl");
        embedded_asset!(app, "image_based.wgsl");
        embedded_asset!(app, "toon.wgsl");
        outline::build(app);
        soft_edges::build(app);
        app.register_type::<SurfaceStyle>()
            .add_plugins((
                MaterialPlugin::<PhantomMaterial>::default(),
                MaterialPlugin::<ImageBasedMaterial>::default(),
                MaterialPlugin::<ToonMaterial>::default(),
            ))
            .init_resource::<phantom::PhantomMaterials>()
            .init_resource::<style::StyledMaterials<DomeShadowed>>()
            .init_resource::<style::StyledMaterials<ToonShaded>>()
            .add_systems(
                PostUpdate,
                (
                    (phantom::update_phantom_materials, phantom::assign_phantom_materials).chain(),
                    (style::update_styled_materials::<DomeShadowed>, style::update_styled_materials::<ToonShaded>),
                    (style::restore_originals::<DomeShadowed>, style::restore_originals::<ToonShaded>),
                    (style::apply_styles::<DomeShadowed>, style::apply_styles::<ToonShaded>),
                    (outline::erase_outlines, outline::forget_changed_hulls),
                    (outline::draw_outlines, alpha_mask::mark_alpha_masks),
                )
                    .chain()
                    // Without a renderer there is nothing to dress.
                    .run_if(resource_exists::<DomeTextures>)
                    .in_set(MirrorballSystems::Dress)
                    .before(bevy::asset::AssetEventSystems),
            );
    }
}
