//! The measured environment as a component.

use super::cube_image;
use bevy::prelude::*;

/// Measured environment as a cube map, on the entity of every [`LightProbeSphere`](crate::probe::LightProbeSphere),
/// [`LightProbeCamera`](crate::probe::LightProbeCamera) and every [`ArCamera`](crate::camera::ArCamera) that a game
/// does not light itself. All of them have the same cube. (A second `ArCamera` that sees the ball is lit by a cube of
/// its own, [`LiveEnvironment::source`](crate::prefilter::LiveEnvironment::source).)
///
/// The cube has linear camera units, world axes, 16-bit floats, one mip level and the edge length
/// [`SIZE`](Self::SIZE). Alpha is the confidence, 0…1: pixels of the frame per texel along an edge, at most 1, where
/// a direction is visible; less with age where it was visible earlier; 0.001 where it is a guess. The GPU writes the
/// cube, so do not change its [`Image`] asset.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{environment_map::EnvironmentCube, prelude::*};
/// type Other = (With<Camera3d>, Without<ArCamera>);
/// fn light_another(mut commands: Commands, cubes: Query<&EnvironmentCube>, camera: Single<Entity, Other>) {
///     if let Some(cube) = cubes.iter().next() {
///         commands.entity(*camera).insert(LiveEnvironment::new(cube.0.clone()));
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct EnvironmentCube(pub Handle<Image>);

impl EnvironmentCube {
    /// Edge length of a face in texels. A texel covers 0.7°, less than a pixel on a ball of 150 pixels in diameter.
    pub const SIZE: u32 = 128;

    pub(crate) fn allocate(images: &mut Assets<Image>) -> Self {
        Self(images.add(cube_image("mirrorball_probe_cube", Self::SIZE, 1)))
    }
}

/// Marker of entities that a game lights itself. A camera that is spawned with it needs no fallback.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct LitByGame;
