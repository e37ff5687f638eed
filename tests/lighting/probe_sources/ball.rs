//! Balls that are covered or cut off.

use super::{
    BALL, BALL_TOLERANCE, INTRINSICS, SIZE, add_ball, add_camera, app, judge, looking_at, photograph, read, settle,
};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{prelude::*, probe::ProbeMeasurement};
use std::time::Duration;

#[test]
fn a_covered_ball_keeps_what_it_showed_before() {
    let Some(mut app) = app() else { return };
    // What was seen is believed for some seconds: not those of a busy machine.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let pose = looking_at(BALL);
    let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
    let probe = add_ball(&mut app);
    settle(&mut app);
    let free = app.world().get::<ProbeMeasurement>(probe).expect("a required component").seen_fraction;

    // A plate halfway to the ball, over the right half of it.
    let eye = pose.translation;
    let plate = pose.transform_point(Vec3::new(0.06, 0.0, -0.5 * eye.distance(BALL)));
    let place = Transform::from_translation(plate).with_rotation(pose.rotation);
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::new(0.12, 0.16, 0.002));
    app.world_mut().spawn((Mesh3d(mesh), PhantomObject::default(), place));
    let covered = photograph(pose, |pixel| pixel.x > INTRINSICS.center.x);
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(covered).with_pace(FeedPace::Lockstep));
    settle(&mut app);
    let measurement = app.world().get::<ProbeMeasurement>(probe).expect("a required component").clone();
    let cube = read(&mut app);
    let axis = (eye - BALL).normalize();
    let right = pose.right();
    let is_behind_plate = |dir: Vec3| dir.dot(axis) > -0.6 && dir.dot(*right) > 0.1;
    let (error, darkest) = judge(&cube, is_behind_plate);
    println!(
        "seen {free:.2} → {:.2} of all directions; behind the plate off by {:.1} %, darkest {darkest:.2}",
        measurement.seen_fraction,
        100.0 * error
    );
    assert!(measurement.is_in_view && free > 0.8);
    assert!((0.3..0.65).contains(&(measurement.seen_fraction / free)));
    assert!(error < BALL_TOLERANCE && darkest > 0.1);
    let (everywhere, _) = judge(&cube, |dir| dir.dot(axis) > -0.6);
    assert!(everywhere < BALL_TOLERANCE, "{everywhere}");
}

#[test]
fn a_ball_cut_off_by_the_border_is_used_as_far_as_it_goes() {
    let Some(mut app) = app() else { return };
    // The ball leaves the picture to the left by half its width.
    let pose = looking_at(BALL);
    let aside = pose.rotation * Quat::from_rotation_y(-(SIZE.x as f32 * 0.5 / 250.0).atan());
    let pose = Transform { rotation: aside, ..pose };
    add_camera(&mut app, pose, photograph(pose, |_| false));
    let probe = add_ball(&mut app);
    settle(&mut app);
    let measurement = app.world().get::<ProbeMeasurement>(probe).expect("a required component").clone();
    let cube = read(&mut app);
    let axis = (pose.translation - BALL).normalize();
    let (seen, darkest) = judge(&cube, |dir| dir.dot(axis) > -0.5 && dir.dot(*looking_at(BALL).right()) > 0.25);
    let (_, darkest_of_all) = judge(&cube, |_| true);
    println!(
        "{:.2} seen, off by {:.1} %, darkest {darkest:.2} there, {darkest_of_all:.2} anywhere",
        measurement.seen_fraction,
        100.0 * seen
    );
    assert!(measurement.is_in_view && (0.2..0.7).contains(&measurement.seen_fraction));
    assert!(seen < BALL_TOLERANCE && darkest_of_all > 0.05);
}
