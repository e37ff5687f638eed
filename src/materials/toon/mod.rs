//! Toon surfaces: flat bands of the room's light.
//!
//! **Enters:** [`SurfaceStyle::Toon`](super::SurfaceStyle::Toon) of meshes, the view's environment map, the lamps of
//! the scene and the shadows of the dome. **Leaves:** a [`ToonMaterial`] on each of these meshes. The formulas are in
//! the documentation of [`materials`](super#toon).

mod toon_material;

pub use toon_material::{ToonMaterial, ToonShaded};

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

pub(super) fn build(app: &mut App) {
    load_shader_library!(app, "room_light.wgsl");
    embedded_asset!(app, "toon.wgsl");
    app.add_plugins(MaterialPlugin::<ToonMaterial>::default());
}
