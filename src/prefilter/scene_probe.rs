//! Scene probes: the virtual scene as an environment, so that moving virtual objects reflect each other and the room.

use bevy::prelude::*;
use std::f32::consts::FRAC_PI_2;

/// Renders the virtual scene around this entity into a cube, over the real environment, and lights the surroundings
/// with it. Put it on a [`LightProbe`].
///
/// The faces follow the position of the entity, not its rotation or scale. The cube becomes the source of a
/// [`LiveEnvironment`](super::LiveEnvironment) on the same entity, which is filtered again when all six faces are
/// rendered (its [`refresh`](super::LiveEnvironment::refresh) may be changed). Each face is a whole camera for the
/// engine; [`faces_per_frame`](Self::faces_per_frame) limits the cost.
///
/// [`RenderLayers`](bevy::camera::visibility::RenderLayers) on this entity are those of the faces. Use them to keep
/// out objects that should not see themselves, such as a mirror with the probe in its center.
/// [Phantoms](crate::phantom::PhantomObject) are not rendered: the real things are in the background already. Lights
/// have to be on a layer of the faces, too. Mirrors that the probe sees show its own last cube: light bounces once
/// per refresh, weaker each time as long as surfaces reflect less than they receive.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_mirrorball::prefilter::SceneProbe;
///
/// fn setup(mut commands: Commands) {
///     commands.spawn((
///         LightProbe::default(),
///         SceneProbe { faces_per_frame: 2, ..default() },
///         // Lights everything within half a meter.
///         Transform::from_xyz(0.0, 0.2, 0.0).with_scale(Vec3::splat(1.0)),
///     ));
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Default, Debug, Clone)]
#[require(Transform, Visibility)]
pub struct SceneProbe {
    /// Edge length of a face in texels, 16 to 1024, rounded up to a power of two. Defaults to 128.
    pub edge: u32,
    /// Faces rendered per frame, 0 (the cube stays as it is) to 6; more counts as 6. Defaults to 1: a new cube is
    /// complete after six frames.
    pub faces_per_frame: u32,
    /// Distance of the near plane in meters, at least 0.0001. Defaults to 0.01.
    pub near: f32,
    /// Distance of the far plane in meters, more than `near`. Defaults to 100.
    pub far: f32,
    /// Background behind the virtual objects, which also lights them: a cube map in frame buffer units, world axes.
    /// `None` is the first measured [`EnvironmentCube`](crate::environment_map::EnvironmentCube), or black if there
    /// is none. Defaults to `None`.
    pub background: Option<Handle<Image>>,
}

// Handles take their components out of Bevy's blanket `FromTemplate`, and one that is derived would not have these
// defaults.
impl Unpin for SceneProbe {}

impl Default for SceneProbe {
    fn default() -> Self {
        Self { edge: 128, faces_per_frame: 1, near: 0.01, far: 100.0, background: None }
    }
}

impl SceneProbe {
    pub(super) fn cube_edge(&self) -> u32 {
        self.edge.clamp(16, 1024).next_power_of_two()
    }

    pub(super) fn near_plane(&self) -> f32 {
        if self.near.is_finite() { self.near.max(1e-4) } else { 0.01 }
    }

    pub(super) fn projection(&self) -> Projection {
        let near = self.near_plane();
        let far = if self.far > near { self.far } else { 1e4 * near };
        PerspectiveProjection { fov: FRAC_PI_2, aspect_ratio: 1.0, near, far, ..default() }.into()
    }
}

/// Cube that a [`SceneProbe`] renders, on the same entity.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::{prelude::LiveEnvironment, prefilter::SceneCube};
/// fn light_by_scene(mut commands: Commands, cubes: Query<&SceneCube>, camera: Single<Entity, With<Camera3d>>) {
///     if let Some(scene) = cubes.iter().next() {
///         commands.entity(*camera).insert(LiveEnvironment::new(scene.cube.clone()));
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct SceneCube {
    /// Cube map of 16-bit floats in frame buffer units, world axes. Alpha is the reciprocal distance in 1/m of what is
    /// shown, 0 for the background. The GPU writes it, so do not change its [`Image`] asset.
    pub cube: Handle<Image>,
    pub(super) faces: [Handle<Image>; 6],
    pub(crate) cameras: [Entity; 6],
    pub(super) edge: u32,
    /// Index of the face that is rendered next.
    pub(super) next: usize,
    /// Faces rendered in this frame: index of the first, and number.
    pub(super) due: (usize, usize),
}
