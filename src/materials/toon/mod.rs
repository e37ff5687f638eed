//! Toon surfaces: flat bands of the room's light.
//!
//! **Enters:** [`SurfaceStyle::Toon`](super::SurfaceStyle::Toon) and [`ToonRamps`] of meshes, the view's environment
//! map, the lamps of the scene, the strongest [`RealLight`](crate::lighting::RealLight) and the shadows of the dome.
//! **Leaves:** a [`ToonMaterial`] on each of these meshes. The formulas are in the documentation of
//! [`materials`](super#toon).

mod ramps;
mod toon_material;
mod toon_uniform;

pub use ramps::ToonRamps;
pub(super) use ramps::{RampImages, RampPair, read_ramps};
pub use toon_material::{ToonMaterial, ToonShaded};

use bevy::{asset::embedded_asset, prelude::*, shader::load_shader_library};

pub(super) fn build(app: &mut App) {
    load_shader_library!(app, "bands.wgsl");
    load_shader_library!(app, "key_light.wgsl");
    load_shader_library!(app, "room_light.wgsl");
    load_shader_library!(app, "toon_bindings.wgsl");
    embedded_asset!(app, "toon.wgsl");
    app.add_plugins(MaterialPlugin::<ToonMaterial>::default()).init_resource::<RampImages>();
}
