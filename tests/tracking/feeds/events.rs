//! Events of feeds that are interrupted and resume.

use super::{SIDECAR, SIZE, gray, player, state, update_until, write_clip};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{FeedLost, FeedRecovered, FeedState, FramePixels, any_feed_lost},
    prelude::*,
};

/// What the observers have seen of a camera: that its feed was lost and whether it resumes, or `None` when it has
/// recovered.
#[derive(Component, Default)]
struct Log(Vec<Option<(String, bool)>>);

fn observe(app: &mut App, feed: CameraFeed) -> Entity {
    let mut camera = app.world_mut().spawn((ArCamera::default(), feed, Log::default()));
    camera.observe(|lost: On<FeedLost>, mut logs: Query<&mut Log>| -> Result {
        logs.get_mut(lost.entity)?.0.push(Some((lost.reason.clone(), lost.resumes)));
        Ok(())
    });
    camera.observe(|recovered: On<FeedRecovered>, mut logs: Query<&mut Log>| -> Result {
        logs.get_mut(recovered.entity)?.0.push(None);
        Ok(())
    });
    camera.id()
}

fn take(app: &mut App, camera: Entity) -> Vec<Option<(String, bool)>> {
    std::mem::take(&mut app.world_mut().get_mut::<Log>(camera).expect("spawned with it").0)
}

#[test]
fn a_damaged_frame_is_a_loss_and_the_next_good_one_a_recovery() {
    let folder = write_clip("events", SIDECAR, &[("a.png", 10), ("d.png", 40)]);
    for damaged in ["b.png", "c.png"] {
        std::fs::write(folder.join(damaged), b"no picture").expect("written");
    }
    let mut app = player();
    let feed = CameraFeed::clip(&folder).with_pace(FeedPace::Lockstep);
    let camera = observe(&mut app, feed);
    app.update();
    assert_eq!(take(&mut app, camera), [], "the first frame is no recovery");
    app.update();
    let events = take(&mut app, camera);
    assert!(matches!(&events[..], [Some((reason, true))] if reason.contains("b.png")), "{events:?}");
    app.update();
    assert!(matches!(state(&app, camera), FeedState::Lost(reason) if reason.contains("c.png")));
    assert_eq!(take(&mut app, camera), [], "another reason for the same state");
    app.update();
    assert_eq!((gray(&app, camera), take(&mut app, camera)), (Some(40), vec![None]));
    app.update();
    assert_eq!((gray(&app, camera), take(&mut app, camera)), (Some(10), vec![]), "the loop goes on");
}

#[test]
fn a_feed_that_cannot_be_opened_is_lost_until_another_one_plays() {
    let mut app = player();
    let camera = observe(&mut app, CameraFeed::clip("no such clip"));
    app.update();
    let events = take(&mut app, camera);
    assert!(matches!(&events[..], [Some((reason, false))] if reason.contains("no such clip")), "{events:?}");
    app.world_mut().entity_mut(camera).insert(CameraFeed::clip("nor this one"));
    app.update();
    assert_eq!(take(&mut app, camera), [], "it has failed before");
    let pixels = FramePixels::new(SIZE, vec![50; 4 * SIZE.element_product() as usize]).expect("fits");
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(pixels));
    assert!(update_until(&mut app, |app| state(app, camera) == FeedState::Playing));
    assert_eq!(take(&mut app, camera), [None]);
}

#[test]
fn the_condition_follows_the_state() {
    #[derive(Resource, Default)]
    struct Ran(u32);
    let mut app = player();
    app.init_resource::<Ran>().add_systems(Update, (|mut ran: ResMut<Ran>| ran.0 += 1).run_if(any_feed_lost));
    let pixels = FramePixels::new(SIZE, vec![50; 4 * SIZE.element_product() as usize]).expect("fits");
    app.world_mut().spawn((ArCamera::default(), CameraFeed::pixels(pixels)));
    let camera = app.world_mut().spawn((ArCamera::default(), CameraFeed::clip("no such clip"))).id();
    app.update();
    app.update();
    assert_eq!(app.world().resource::<Ran>().0, 2);
    // The state of a camera without a feed is of no interest.
    app.world_mut().entity_mut(camera).remove::<CameraFeed>();
    app.update();
    assert_eq!(app.world().resource::<Ran>().0, 2);
}
