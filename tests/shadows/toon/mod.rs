//! Toon surfaces under known light: one lamp, a sky of known irradiance, the shadow of a wall.

mod bands;
mod color_difference;
mod contrast;
mod key_light;
mod outline;
mod phong;
mod ramps;
mod styles;
mod surfaces;
