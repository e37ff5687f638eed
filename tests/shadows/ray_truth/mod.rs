//! The dome's shadows against rays: what share of the sky's light reaches a place on a desk between boxes and balls.

mod key_lights;
mod rays;
mod skies;
mod virtual_scene;
