//! Dome shadows against ray casting: the fraction of the sky's light that reaches a desk between boxes and balls.

mod key_lights;
pub(crate) mod rays;
mod skies;
mod thin_casters;
mod virtual_scene;
