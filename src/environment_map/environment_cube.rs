//! The measured environment, as a component.

use super::cube_image;
use bevy::prelude::*;

/// The environment as a cube map, on the entity of every [`LightProbeSphere`](crate::probe::LightProbeSphere),
/// [`LightProbeCamera`](crate::probe::LightProbeCamera) and every [`ArCamera`](crate::camera::ArCamera) that a game does not
/// light by itself; it is the same on all of them.
///
/// Linear camera units, world axes, 16-bit float, one mip level, edge length [`SIZE`](Self::SIZE). Alpha is the confidence, 0…1: pixels
/// of the picture per texel (along an edge, at most 1) where a direction is seen, less with age where it was seen earlier, 0.001 where
/// it is a guess. Written by the GPU: do not change the [`Image`] asset behind it.
#[derive(Component, Clone, Debug)]
pub struct EnvironmentCube(pub Handle<Image>);

impl EnvironmentCube {
    /// Edge length of a face in texels: 0.7° each, finer than the pixels of a ball 150 pixels across.
    pub const SIZE: u32 = 128;

    pub(crate) fn allocate(images: &mut Assets<Image>) -> Self {
        Self(images.add(cube_image("mirrorball_probe_cube", Self::SIZE, 1)))
    }
}

/// On whatever has light of its own already; a camera spawned with it needs no fallback.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct LitByGame;
