//! The camera or the anchors move to where the markers are seen.

use crate::scripted_desk::{Desk, HARD_TO_READ, SIZE, assert_same, first_view, second_view, seen};
use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    tracking::{DetectedMarker, DetectedMarkers, MarkerState, MarkerTracking},
};
use std::f32::consts::PI;

#[test]
fn with_a_world_origin_the_camera_moves_and_the_anchor_stays() {
    let mut desk = Desk::new();
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    for view in [first_view(), second_view()] {
        desk.show(&[seen(0, view)]);
        assert_same(desk.world_from(desk.camera), view.inverse());
        assert_eq!(desk.get::<Transform>(anchor), Transform::IDENTITY);
    }
    let tracking = desk.tracking(anchor);
    assert_eq!((tracking.state, tracking.last_seen), (MarkerState::Tracked, Some(2)));
    assert_same(tracking.camera_from_marker.expect("a pose"), second_view());
    assert_eq!(desk.get::<DetectedMarkers>(desk.camera).sequence, 2);
}

#[test]
fn a_world_origin_stays_wherever_the_game_put_it() {
    let mut desk = Desk::new();
    let place = Transform::from_xyz(1.0, 0.7, -2.0).with_rotation(Quat::from_euler(EulerRot::YXZ, 2.0, 0.3, -0.5));
    let alone = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin, place));
    desk.show(&[seen(0, first_view())]);
    assert_eq!(desk.get::<Transform>(alone), place);
    assert_same(desk.world_from(desk.camera), place.to_isometry() * first_view().inverse());

    let table = desk.spawn(Transform::from_xyz(-4.0, 0.5, 0.2).with_rotation(Quat::from_rotation_y(1.2)));
    desk.app.world_mut().entity_mut(table).add_child(alone);
    desk.show(&[seen(0, second_view())]);
    assert_eq!(desk.get::<Transform>(alone), place);
    let world_from_anchor = desk.get::<Transform>(table).to_isometry() * place.to_isometry();
    assert_same(desk.world_from(desk.camera), world_from_anchor * second_view().inverse());
}

#[test]
fn a_camera_on_a_rig_ends_up_where_the_marker_says() {
    let mut desk = Desk::new();
    let rig = desk.spawn(Transform::from_xyz(0.0, 5.0, 0.0).with_rotation(Quat::from_rotation_x(0.4)));
    desk.app.world_mut().entity_mut(rig).add_child(desk.camera);
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    desk.show(&[seen(0, first_view())]);
    desk.assert_camera_from(anchor, first_view());
    assert_same(desk.world_from(desk.camera), first_view().inverse());
}

#[test]
fn without_a_world_origin_the_anchor_moves_and_the_camera_stays() {
    let mut desk = Desk::new();
    let before = desk.get::<Transform>(desk.camera);
    let scale = Vec3::new(2.0, 3.0, 4.0);
    let free = desk.spawn((MarkerAnchor::new(0, SIZE), Transform::from_scale(scale)));
    let table = desk.spawn(Transform::from_xyz(-4.0, 0.5, 0.2).with_rotation(Quat::from_rotation_y(PI / 3.0)));
    let child = desk.spawn((MarkerAnchor::new(7, SIZE), ChildOf(table)));
    for (one, other) in [(first_view(), second_view()), (second_view(), first_view())] {
        desk.show(&[seen(0, one), seen(7, other)]);
        assert_eq!(desk.get::<Transform>(desk.camera), before);
        desk.assert_camera_from(child, other);
        let placed = desk.get::<Transform>(free);
        assert_same(placed.to_isometry(), before.to_isometry() * one);
        assert_eq!(placed.scale, scale, "the game's own scale is kept");
    }
}

#[test]
fn other_anchors_move_relative_to_the_world_origin() {
    let mut desk = Desk::new();
    let origin = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    let cube = desk.spawn(MarkerAnchor::new(7, SIZE));
    let origin_from_cube = Isometry3d::new(Vec3::new(0.08, 0.05, -0.1), Quat::from_rotation_y(0.8));
    for view in [first_view(), second_view()] {
        desk.show(&[seen(0, view), seen(7, view * origin_from_cube)]);
        assert_eq!(desk.get::<Transform>(origin), Transform::IDENTITY);
        // The markers keep their relation while the camera walks around them.
        assert_same(desk.world_from(cube), origin_from_cube);
    }
}

#[test]
fn a_lost_marker_holds_its_pose_and_recovers() {
    let mut desk = Desk::new();
    let origin = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    let cube = desk.spawn(MarkerAnchor::new(7, SIZE));
    assert_eq!(desk.tracking(origin).state, MarkerState::Searching);
    desk.show(&[seen(0, first_view()), seen(7, second_view())]);
    let held = [desk.get::<Transform>(desk.camera), desk.get::<Transform>(origin), desk.get::<Transform>(cube)];
    // Frames come every 40 ms.
    for expected in [&[MarkerState::Held; 12][..], &[MarkerState::Lost; 2]].concat() {
        desk.show(&[]);
        let now = [desk.get::<Transform>(desk.camera), desk.get::<Transform>(origin), desk.get::<Transform>(cube)];
        assert_eq!(now, held);
        for anchor in [origin, cube] {
            let tracking = desk.tracking(anchor);
            assert_eq!((tracking.state, tracking.last_seen), (expected, Some(1)));
            assert!(tracking.camera_from_marker.is_some() && tracking.candidates.is_none());
        }
    }
    desk.show(&[seen(0, second_view())]);
    assert_same(desk.world_from(desk.camera), second_view().inverse());
    assert_eq!((desk.tracking(origin).state, desk.tracking(origin).last_seen), (MarkerState::Tracked, Some(16)));
    assert_eq!(desk.tracking(cube).state, MarkerState::Lost);
    assert_eq!(desk.get::<Transform>(cube), held[2], "a lost anchor stays in the world, not in the picture");
}

#[test]
fn an_anchor_added_after_the_picture_arrived_is_posed() {
    let mut desk = Desk::new();
    desk.show(&[seen(0, first_view()), seen(7, second_view())]);
    desk.app.update();
    let anchor = desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.app.update();
    assert_eq!(desk.tracking(anchor).state, MarkerState::Tracked);
    desk.assert_camera_from(anchor, second_view());
}

#[test]
fn a_small_marker_is_searched_closer_when_its_anchor_comes_after_the_picture() {
    let mut desk = Desk::new();
    desk.show(&[DetectedMarker { corrected_bits: HARD_TO_READ, ..seen(7, second_view()) }]);
    assert!(desk.get::<DetectedMarkers>(desk.camera).markers.is_empty());
    let anchor = desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.app.update();
    assert_eq!(desk.tracking(anchor).state, MarkerState::Tracked);
    desk.assert_camera_from(anchor, second_view());
}

#[test]
fn an_anchor_that_cannot_exist_keeps_searching_until_it_is_corrected() {
    let mut desk = Desk::new();
    let impossible = [(587, SIZE), (u32::MAX, SIZE), (3, 0.0), (3, -SIZE), (3, f32::NAN), (3, f32::INFINITY)];
    let anchors = impossible.map(|(id, size)| desk.spawn(MarkerAnchor::new(id, size)));
    let before = desk.get::<Transform>(desk.camera);
    let markers = [seen(587, first_view()), seen(u32::MAX, first_view()), seen(3, second_view())];
    for _ in 0..2 {
        desk.show(&markers);
        for anchor in anchors {
            assert_eq!(desk.tracking(anchor), MarkerTracking::default());
            assert_eq!(desk.get::<Transform>(anchor), Transform::IDENTITY);
        }
    }
    desk.app.world_mut().entity_mut(anchors[4]).insert(MarkerAnchor::new(3, SIZE));
    desk.app.update();
    assert_eq!(desk.tracking(anchors[4]).state, MarkerState::Tracked);
    desk.assert_camera_from(anchors[4], second_view());
    assert_eq!(desk.get::<Transform>(desk.camera), before);
}

#[test]
fn of_two_sheets_with_one_number_the_first_is_followed() {
    let mut desk = Desk::new();
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    desk.show(&[seen(0, first_view())]);
    assert_eq!(desk.tracking(anchor).copies, 1);
    // The other one moves about and is detected first or last, and alone in the end.
    let other = |i: i32| first_view() * Isometry3d::from_translation(Vec3::new(0.25, 0.0, 0.01 * i as f32));
    for i in 0..10 {
        let mut markers = [seen(0, first_view()), seen(0, other(i))];
        markers.rotate_left(i as usize % 2);
        desk.show(&markers);
        assert_eq!((desk.tracking(anchor).copies, desk.tracking(anchor).state), (2, MarkerState::Tracked));
        assert_same(desk.world_from(desk.camera), first_view().inverse());
    }
    desk.show(&[seen(0, other(10))]);
    assert_eq!(desk.tracking(anchor).state, MarkerState::Held, "the other does not take its place");
    assert_same(desk.world_from(desk.camera), first_view().inverse());
}

/// Scales of whole scenes: centimeters, twice as large, and what only artists do.
const SCALES: [Vec3; 3] = [Vec3::splat(0.01), Vec3::splat(2.0), Vec3::new(0.5, 0.25, 2.0)];

fn scaled(scale: Vec3) -> Transform {
    Transform::from_xyz(-4.0, 0.5, 0.2).with_rotation(Quat::from_rotation_y(1.2)).with_scale(scale)
}

#[test]
fn an_anchor_below_a_scaled_parent_is_placed_at_the_tracked_distance() {
    for scale in SCALES {
        let mut desk = Desk::new();
        let table = desk.spawn(scaled(scale));
        let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), ChildOf(table)));
        desk.show(&[seen(0, first_view())]);
        let found = desk.world_from(anchor).translation;
        let expected = (desk.world_from(desk.camera) * first_view()).translation;
        assert!(found.distance(expected) < 1e-5, "scale {scale}: {found} instead of {expected}");
        if scale.x == scale.y {
            desk.assert_camera_from(anchor, first_view());
        }
    }
}

#[test]
fn a_camera_below_a_scaled_parent_is_placed_at_the_tracked_distance() {
    for scale in SCALES {
        let mut desk = Desk::new();
        let rig = desk.spawn(scaled(scale));
        desk.app.world_mut().entity_mut(rig).add_child(desk.camera);
        desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
        desk.show(&[seen(0, first_view())]);
        let (found, expected) = (desk.world_from(desk.camera).translation, first_view().inverse().translation);
        assert!(found.distance(expected) < 1e-5, "scale {scale}: {found} instead of {expected}");
    }
}

#[test]
fn a_scene_in_centimeters_with_a_world_origin_needs_no_correction() {
    let mut desk = Desk::new();
    let scene = desk.spawn(Transform::from_scale(Vec3::splat(0.01)));
    let origin = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin, Transform::from_xyz(30.0, 0.0, 10.0)));
    let cube = desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.app.world_mut().entity_mut(scene).add_children(&[origin, cube]);
    let origin_from_cube = Isometry3d::new(Vec3::new(0.08, 0.05, -0.1), Quat::from_rotation_y(0.8));
    desk.show(&[seen(0, first_view()), seen(7, first_view() * origin_from_cube)]);
    let world_from_origin = Isometry3d::from_xyz(0.3, 0.0, 0.1);
    assert_same(desk.world_from(desk.camera), world_from_origin * first_view().inverse());
    assert_same(desk.world_from(cube), world_from_origin * origin_from_cube);
}
