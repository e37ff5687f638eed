//! Classic surfaces: image-based shading by sums of lookups in the environment maps.
//!
//! **Enters:** [`SurfaceStyle::Classic`](super::SurfaceStyle::Classic) of meshes, the strongest
//! [`RealLight`](crate::lighting::RealLight), the view's environment maps and the shadows of the dome. **Leaves:** a
//! [`ClassicMaterial`] on each of these meshes. The formulas are in the documentation of
//! [`materials`](super#classic-models).

mod classic_material;
mod classic_uniform;
mod gloss;

pub use classic_material::{ClassicMaterial, ClassicShaded};
pub use gloss::{exponent_from_perceptual_roughness, perceptual_roughness_from_exponent};

use bevy::{asset::embedded_asset, prelude::*};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "classic.wgsl");
    app.add_plugins(MaterialPlugin::<ClassicMaterial>::default());
}
