//! The printed mat in the world, wherever the camera sees it, and markers on shoes.

use crate::{
    dance_mat::DanceMat,
    game::{Shoe, StepField},
    song::Lane,
};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Numbers of the markers on the shoes, and their size in meters.
const SHOE_MARKERS: [u32; 2] = [30, 31];
const SHOE_MARKER_SIZE: f32 = 0.05;

/// Spawns the markers of the mat with a field for each lane, and those of the shoes.
pub(crate) fn spawn(world: &mut World, mat: DanceMat, has_shoes: bool) {
    world.spawn((mat.anchor(), mat.board(), Visibility::default())).with_children(|sheet| {
        for (lane, center) in Lane::ALL.into_iter().zip(mat.field_centers()) {
            let place = Transform::from_xyz(center.x, 0.0, center.y);
            sheet.spawn((StepField::new(lane), VirtualButton::new(mat.field_size()), place));
        }
    });
    if has_shoes {
        for marker in SHOE_MARKERS {
            world.spawn((Shoe::default(), MarkerAnchor::new(marker, SHOE_MARKER_SIZE)));
        }
    }
}
