//! Environment maps: cubes and equirectangular images of the light from all directions, in memory, in files and on
//! the GPU.
//!
//! This module is the ground floor for the stages that measure light ([`probe`](crate::probe),
//! [`unwrap`](crate::unwrap)) and those that light a scene with it ([`prefilter`](crate::prefilter),
//! [`shadows`](crate::shadows)).
//!
//! # Conventions
//! A cube has six square layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame whose z is the negative of the world's,
//! as in Bevy. An equirectangular image is twice as wide as high; column ÷ width is the azimuth from −Z towards +X, and
//! rows run from +Y down. Both hold linear radiance in camera units.
//!
//! [`CubePixels`] and [`equirect_direction`] implement the formulas on the CPU, `cubemap.wgsl` those of cubes for the
//! shaders.

mod cube_image;
mod cube_pixels;
mod cube_writes;
mod cubemap;
mod environment_cube;
mod equirect;
mod files;
mod harmonics;
mod pending_cubes;

pub use cube_pixels::CubePixels;
pub use cube_writes::CubeWrites;
pub use environment_cube::EnvironmentCube;
pub use equirect::{EquirectPixels, equirect_direction, equirect_position};
pub use files::EnvironmentFileError;
pub use harmonics::EnvironmentHarmonics;

pub(crate) use cube_image::{cube_faces, cube_image};
pub(crate) use cubemap::cube_directions;
pub(crate) use environment_cube::LitByGame;
pub(crate) use pending_cubes::PendingCubes;

use cubemap::{face_direction, face_position};

use bevy::{prelude::*, shader::load_shader_library};

/// Loads the shader library of cube faces for the shaders of a plugin.
pub(crate) fn load_shaders(app: &mut App) {
    load_shader_library!(app, "cubemap.wgsl");
}
