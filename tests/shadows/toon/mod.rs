//! Toon surfaces under known light: one lamp, a sky of known irradiance, the shadow of a wall.

mod bands;
mod outline;
mod styles;
