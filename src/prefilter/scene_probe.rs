//! The virtual scene around a point as an environment, so that moving virtual objects mirror each other and the room.

use bevy::prelude::*;
use std::f32::consts::FRAC_PI_2;

/// Renders the virtual scene around this entity into a cube, over the real environment, and lights the surroundings by it: put
/// it on a [`LightProbe`].
///
/// The faces follow the entity's place, not its turn or size. The cube gets into a [`LiveEnvironment`](super::LiveEnvironment) on the same entity,
/// which is filtered anew when all six faces are (its [`refresh`](super::LiveEnvironment::refresh) may be changed). Each face is a whole
/// camera for the engine: [`faces_per_frame`](Self::faces_per_frame) bounds the cost.
///
/// What should not see itself, such as a mirror in whose middle the probe is, is kept out by [`RenderLayers`](bevy::camera::visibility::RenderLayers) on this entity:
/// they are those of the faces. The same goes for [phantoms](crate::phantom::PhantomObject), which show what the main camera sees
/// and nothing useful in other directions; lights have to be on a layer that the faces have, too. Mirrors that the probe sees
/// show its own last cube: light goes back and forth once per refresh, weaker each time as long as surfaces reflect less
/// than they receive.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::SceneProbe;
///
/// fn setup(mut commands: Commands) {
///     commands.spawn((
///         LightProbe::default(),
///         SceneProbe { faces_per_frame: 2, ..default() },
///         // Lights everything within half a metre.
///         Transform::from_xyz(0.0, 0.2, 0.0).with_scale(Vec3::splat(1.0)),
///     ));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Default, Debug, Clone)]
#[require(Transform, Visibility)]
pub struct SceneProbe {
    /// Edge length of a face in texels; the next power of two from 16 to 1024 is taken. Defaults to 128.
    pub edge: u32,
    /// Faces rendered in a frame, 0 (the cube stays as it is) to 6; more counts as 6. Defaults to 1: the cube is new after six
    /// frames.
    pub faces_per_frame: u32,
    /// Distance in metres from which things are seen; at least 0.0001. Defaults to 0.01.
    pub near: f32,
    /// Distance in metres up to which things are seen; more than `near`. Defaults to 100.
    pub far: f32,
    /// What is behind the virtual things and lights them: a cube map in frame buffer units, world axes. `None` takes the first
    /// measured [`EnvironmentCube`](crate::environment_map::EnvironmentCube), or black where there is none. Defaults to `None`.
    pub background: Option<Handle<Image>>,
}

impl Default for SceneProbe {
    fn default() -> Self {
        Self { edge: 128, faces_per_frame: 1, near: 0.01, far: 100.0, background: None }
    }
}

impl SceneProbe {
    pub(super) fn cube_edge(&self) -> u32 {
        self.edge.clamp(16, 1024).next_power_of_two()
    }

    pub(super) fn projection(&self) -> Projection {
        let near = if self.near.is_finite() { self.near.max(1e-4) } else { 0.01 };
        let far = if self.far > near { self.far } else { 1e4 * near };
        PerspectiveProjection { fov: FRAC_PI_2, aspect_ratio: 1.0, near, far, ..default() }.into()
    }
}

/// What a [`SceneProbe`] has seen, on the same entity.
#[derive(Component, Clone, Debug)]
pub struct SceneCube {
    /// Cube map of 16-bit floats in frame buffer units, world axes. Written by the GPU: do not change the asset behind it.
    pub cube: Handle<Image>,
    pub(super) faces: [Handle<Image>; 6],
    pub(super) cameras: [Entity; 6],
    pub(super) edge: u32,
    /// The face that is rendered next.
    pub(super) next: usize,
    /// Faces rendered in this frame: the first, and how many.
    pub(super) due: (usize, usize),
}
