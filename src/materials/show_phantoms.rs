//! Setting of ordinary cameras that see phantoms.

use bevy::prelude::*;

/// Makes an ordinary camera see phantoms: the frame of an [`ArCamera`](crate::camera::ArCamera) is projected onto them
/// from the pose of that camera (projective texture mapping), under the shadows of virtual objects.
///
/// Without this component, cameras that are no `ArCamera` see virtual objects only. An `ArCamera` with a frame shows
/// its own and ignores this component. Phantoms outside of the projected frame are not drawn (mirrors see them in the
/// environment, [`NeighborReflections`](super::NeighborReflections)), and where one real thing hides another from the
/// `ArCamera`, the hidden one is covered with the picture of the one in front. Tone mapping of the camera changes the
/// colors of the frame, so [`Tonemapping::None`](bevy::core_pipeline::tonemapping::Tonemapping::None) is advisable.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::materials::ShowPhantoms;
/// # fn setup(mut commands: Commands) {
/// // A spectator, who sees the real things too, as far as the AR camera shows them.
/// commands.spawn((Camera3d::default(), ShowPhantoms::default(), Transform::from_xyz(1.0, 1.0, 1.0)));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct ShowPhantoms {
    /// The `ArCamera` whose frame is projected. `None` is the first one that has a frame: active cameras come first,
    /// then those of a lower [`Camera::order`], then those spawned earlier. Defaults to `None`.
    pub projector: Option<Entity>,
}
