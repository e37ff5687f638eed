//! Events of markers that come and go.

use crate::scripted_desk::{Desk, SIZE, assert_same, first_view, second_view, seen};
use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    tracking::{
        FrameRecorder, MarkerFound, MarkerLost, MarkerState, PoseFilter, any_marker_tracked, world_origin_tracked,
    },
};
use std::time::Duration;

/// What the observers of a test have seen: the anchor, its number, and whether it was found.
#[derive(Resource, Default)]
struct Log(Vec<(Entity, u32, bool)>);

fn desk() -> Desk {
    let mut desk = Desk::new();
    desk.app
        .init_resource::<Log>()
        .add_observer(|found: On<MarkerFound>, mut log: ResMut<Log>| log.0.push((found.entity, found.marker.id, true)))
        .add_observer(|lost: On<MarkerLost>, mut log: ResMut<Log>| log.0.push((lost.entity, lost.marker.id, false)));
    desk
}

fn take(desk: &mut Desk) -> Vec<(Entity, u32, bool)> {
    std::mem::take(&mut desk.app.world_mut().resource_mut::<Log>().0)
}

#[test]
fn a_marker_is_found_once_lost_once_and_found_again() {
    let mut desk = desk();
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    let other = desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.show(&[]);
    assert_eq!(take(&mut desk), [], "searching is no loss");
    for _ in 0..3 {
        desk.show(&[seen(0, first_view())]);
    }
    assert_eq!(take(&mut desk), [(anchor, 0, true)], "once, not in every frame");
    // Frames come every 40 ms, and markers are held for half a second.
    for _ in 0..12 {
        desk.show(&[]);
        assert_eq!(desk.tracking(anchor).state, MarkerState::Held);
    }
    desk.show(&[seen(0, first_view())]);
    assert_eq!(take(&mut desk), [], "held is not lost");
    for _ in 0..16 {
        desk.show(&[seen(7, second_view())]);
    }
    assert_eq!(take(&mut desk), [(other, 7, true), (anchor, 0, false)]);
    desk.show(&[seen(0, second_view()), seen(7, second_view())]);
    assert_eq!(take(&mut desk), [(anchor, 0, true)]);
}

#[test]
fn observers_of_an_anchor_see_its_own_events_after_everything_has_moved() {
    let mut desk = desk();
    let (camera, anchor) = (desk.camera, desk.spawn(WorldOrigin));
    desk.app.world_mut().entity_mut(anchor).insert(MarkerAnchor::new(0, SIZE)).observe(
        move |found: On<MarkerFound>, places: Query<&Transform>, mut commands: Commands| -> Result {
            assert_eq!(found.camera, Some(camera));
            let seen_from = places.get(camera)?.to_isometry();
            commands.entity(found.entity).insert(Seen(seen_from));
            Ok(())
        },
    );
    desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.show(&[seen(7, first_view())]);
    assert!(desk.app.world().get::<Seen>(anchor).is_none(), "the other one was found");
    desk.show(&[seen(0, second_view()), seen(7, first_view())]);
    assert_same(desk.get::<Seen>(anchor).0, second_view().inverse());
}

#[derive(Component, Clone)]
struct Seen(Isometry3d);

#[test]
fn a_marker_that_has_to_stay_for_a_while_is_found_late() {
    let mut desk = desk();
    let filter = PoseFilter { found_after: Duration::from_millis(100), ..default() };
    let anchor = desk.spawn((MarkerAnchor::new(0, SIZE), filter));
    for expected in [0, 0, 0, 1, 1] {
        desk.show(&[seen(0, first_view())]);
        assert_eq!(desk.app.world().resource::<Log>().0.len(), expected, "{:?}", desk.tracking(anchor));
    }
}

#[test]
fn a_recorder_makes_tracking_start_over() {
    let mut desk = desk();
    let anchor = desk.spawn(MarkerAnchor::new(0, SIZE));
    desk.show(&[seen(0, first_view())]);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("marker_events");
    desk.app.world_mut().entity_mut(desk.camera).insert(FrameRecorder::new(folder));
    desk.app.update();
    desk.show(&[seen(0, first_view())]);
    assert_eq!(take(&mut desk), [(anchor, 0, true), (anchor, 0, false), (anchor, 0, true)]);
}

#[test]
fn a_removed_anchor_says_nothing() {
    let mut desk = desk();
    let [removed, despawned] = [0, 7].map(|id| desk.spawn(MarkerAnchor::new(id, SIZE)));
    desk.show(&[seen(0, first_view()), seen(7, second_view())]);
    assert_eq!(take(&mut desk).len(), 2);
    desk.app.world_mut().entity_mut(removed).remove::<MarkerAnchor>();
    desk.app.world_mut().despawn(despawned);
    for _ in 0..16 {
        desk.show(&[]);
    }
    assert_eq!(take(&mut desk), []);
}

#[test]
fn conditions_hold_between_found_and_lost() {
    #[derive(Resource, Default, Debug, PartialEq)]
    struct Ran {
        any: u32,
        origin: u32,
    }
    let mut desk = desk();
    desk.app.init_resource::<Ran>().add_systems(
        Update,
        (
            (|mut ran: ResMut<Ran>| ran.any += 1).run_if(any_marker_tracked),
            (|mut ran: ResMut<Ran>| ran.origin += 1).run_if(world_origin_tracked),
        ),
    );
    let ran = |desk: &mut Desk| std::mem::take(&mut *desk.app.world_mut().resource_mut::<Ran>());
    desk.spawn((MarkerAnchor::new(0, SIZE), WorldOrigin));
    desk.spawn(MarkerAnchor::new(7, SIZE));
    desk.show(&[]);
    assert_eq!(ran(&mut desk), Ran::default());
    desk.show(&[seen(7, first_view())]);
    assert_eq!(ran(&mut desk), Ran { any: 1, origin: 0 });
    desk.show(&[seen(0, first_view())]);
    assert_eq!(ran(&mut desk), Ran { any: 1, origin: 1 });
    for _ in 0..12 {
        desk.show(&[]);
    }
    assert_eq!(ran(&mut desk), Ran { any: 12, origin: 12 }, "held");
    desk.show(&[]);
    assert_eq!(ran(&mut desk), Ran::default(), "lost");
}
