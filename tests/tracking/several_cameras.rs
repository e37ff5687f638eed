//! Each of several cameras is posed by its own frames.

use crate::{
    lens::LENS,
    scripted_desk::{Desk, SIZE, assert_same, first_view, second_view, seen},
};
use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    tracking::{MarkerState, MarkerViews},
};

fn another_camera(desk: &mut Desk) -> Entity {
    desk.spawn((ArCamera::new(LENS), Camera { order: 1, ..default() }, Transform::from_xyz(-1.0, 0.0, 2.0)))
}

#[test]
fn every_camera_is_posed_by_its_own_frames() {
    let mut desk = Desk::new();
    let other = another_camera(&mut desk);
    desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    desk.show(&[seen(0, first_view())]);
    desk.show_to(other, &[seen(0, second_view())]);
    assert_same(desk.world_from(desk.camera), first_view().inverse());
    assert_same(desk.world_from(other), second_view().inverse());
    desk.show(&[seen(0, second_view())]);
    assert_same(desk.world_from(desk.camera), second_view().inverse());
    assert_same(desk.world_from(other), second_view().inverse());
}

#[test]
fn the_marker_reports_what_each_camera_sees_and_the_first_that_tracks_it() {
    let mut desk = Desk::new();
    let (first, second) = (desk.camera, another_camera(&mut desk));
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    desk.show_to(second, &[seen(0, second_view())]);
    let tracking = desk.tracking(anchor);
    assert_eq!((tracking.state, tracking.camera), (MarkerState::Tracked, Some(second)));
    desk.show_to(first, &[seen(0, first_view())]);
    desk.show_to(second, &[]);
    let views: MarkerViews = desk.get(anchor);
    let state = |camera| views.get(camera).map(|view| view.state);
    assert_eq!((state(first), state(second)), (Some(MarkerState::Tracked), Some(MarkerState::Held)));
    assert_eq!(desk.tracking(anchor).camera, Some(first));
    assert_same(desk.tracking(anchor).camera_from_marker.expect("a pose"), first_view());

    desk.app.world_mut().despawn(first);
    desk.app.update();
    let views: MarkerViews = desk.get(anchor);
    assert_eq!(views.iter().map(|(camera, _)| camera).collect::<Vec<_>>(), [second]);
    assert_eq!((desk.tracking(anchor).camera, desk.tracking(anchor).state), (Some(second), MarkerState::Held));
}

#[test]
fn an_anchor_is_placed_by_a_camera_that_sees_it_and_knows_where_it_is() {
    let mut desk = Desk::new();
    let other = another_camera(&mut desk);
    let origin = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    let cube = desk.spawn(MarkerAnchor::new(7, SIZE));
    let origin_from_cube = Isometry3d::new(Vec3::new(0.08, 0.05, -0.1), Quat::from_rotation_y(0.8));
    // The first camera sees only the cube, and has never seen where the world is.
    desk.show(&[seen(7, second_view())]);
    desk.show_to(other, &[seen(0, first_view()), seen(7, first_view() * origin_from_cube)]);
    assert_eq!(desk.get::<Transform>(origin), Transform::IDENTITY);
    assert_same(desk.world_from(cube), origin_from_cube);
    // The other loses the cube; by now the first knows its place.
    desk.show(&[seen(0, second_view()), seen(7, second_view() * origin_from_cube)]);
    desk.show_to(other, &[seen(0, first_view())]);
    assert_same(desk.world_from(cube), origin_from_cube);
}

#[test]
fn without_a_world_origin_no_camera_moves() {
    let mut desk = Desk::new();
    let other = another_camera(&mut desk);
    let before = [desk.camera, other].map(|camera| desk.get::<Transform>(camera));
    let anchor = desk.spawn(MarkerAnchor::new(0, SIZE));
    desk.show_to(other, &[seen(0, second_view())]);
    assert_same(desk.world_from(anchor), desk.world_from(other) * second_view());
    desk.show(&[seen(0, first_view())]);
    desk.assert_camera_from(anchor, first_view());
    assert_eq!([desk.camera, other].map(|camera| desk.get::<Transform>(camera)), before);
}
