//! Classic surfaces: image-based shading by sums of lookups in the environment maps.
//!
//! **Enters:** [`SurfaceStyle::Classic`](super::SurfaceStyle::Classic) of meshes, the strongest
//! [`RealLight`](crate::lighting::RealLight), the view's environment maps or the ball in the camera frame, and the
//! shadows of the dome. **Leaves:** a
//! [`ClassicMaterial`] on each of these meshes. The formulas are in the documentation of
//! [`materials`](super#classic-models).

mod classic_material;
mod classic_uniform;
mod gloss;
mod sphere_map;

pub use classic_material::{ClassicMaterial, ClassicShaded};
pub use gloss::{exponent_from_perceptual_roughness, perceptual_roughness_from_exponent};

pub(super) use sphere_map::{SphereMap, TEXELS};

use crate::MirrorballSystems;
use bevy::{
    asset::embedded_asset, prelude::*, render::extract_resource::ExtractResourcePlugin, shader::load_shader_library,
};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "classic.wgsl");
    load_shader_library!(app, "sphere_map.wgsl");
    app.add_plugins((MaterialPlugin::<ClassicMaterial>::default(), ExtractResourcePlugin::<SphereMap>::default()))
        .init_resource::<SphereMap>()
        .add_systems(PostUpdate, sphere_map::crop_sphere_map.after(MirrorballSystems::Light));
}
