//! A place as a model on a real desk: lit by the room around it, with its shadows.
//!
//! The place is as small as the dancer is on a desk, so lamps near the desk are near lamps to it. It has neither sky
//! light nor sun nor spot lights of its own: the measured environment lights it, and casts shadows by the dome.

use super::GROWTH;
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Makes meters of a place those of a desk.
pub(super) const DESK_FROM_PLACE: Transform = Transform::from_scale(Vec3::splat(1.0 / GROWTH));

/// A camera that shows a place in the light of the room.
#[derive(Component)]
pub(super) struct LitByRoom;

/// Hides real things: a model of the place stands where they are.
pub(super) fn spawn_desk(world: &mut World, scene: Handle<WorldAsset>) {
    world.spawn((WorldAssetRoot(scene), Visibility::Hidden));
}

/// Lights cameras with the room from when it is measured.
pub(super) fn light_by_room(
    mut commands: Commands,
    rooms: Query<&LiveEnvironment, With<ArCamera>>,
    cameras: Query<Entity, (With<LitByRoom>, Without<LiveEnvironment>)>,
) {
    let Some(room) = rooms.iter().next() else { return };
    for camera in &cameras {
        commands.entity(camera).insert(room.clone());
    }
}

/// Puts out the lamps of a scene.
pub(super) fn put_out_spots(mut spots: Query<&mut Visibility, Added<SpotLight>>) {
    for mut spot in &mut spots {
        *spot = Visibility::Hidden;
    }
}
