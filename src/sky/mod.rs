//! Environments as plain data, for the stages that measure them and those that light by them: cubes and equirectangular pictures
//! on the CPU, their files, and empty cubes on the GPU.

mod cube_image;
mod equirect;
mod files;

pub use equirect::{CubePixels, EquirectPixels, equirect_direction, equirect_position};
pub use files::EnvironmentFileError;

pub(crate) use cube_image::{cube_faces, cube_image};
pub(crate) use equirect::face_direction;

use bevy::{prelude::*, shader::load_shader_library};

/// Makes the library of cube faces known to the shaders of a plugin.
pub(crate) fn load_shaders(app: &mut App) {
    load_shader_library!(app, "cubemap.wgsl");
}
