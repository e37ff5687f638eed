//! Light probe cameras with wide lenses, alone and beside a ball.

use super::{
    BALL, BALL_TOLERANCE, LENS_TOLERANCE, add_ball, add_camera, app, judge, looking_at, photograph, picture, read,
    settle, smooth,
};
use bevy::prelude::*;
use bevy_mirrorball::{
    prelude::*,
    probe::{FisheyeProjection, LightProbeCamera, ProbeCameraState, ProbeLens},
};

#[test]
fn each_lens_gives_the_light_that_it_sees() {
    use FisheyeProjection::{Equidistant, Equisolid, Orthographic, Stereographic};
    let fisheye = |projection, fov_degrees| ProbeLens::Fisheye { projection, fov_degrees, circle: None };
    let lenses = [
        (fisheye(Equidistant, 180.0), -0.05),
        (fisheye(Equisolid, 200.0), 0.1),
        (fisheye(Stereographic, 160.0), -0.25),
        (fisheye(Orthographic, 180.0), -0.2),
        (ProbeLens::Equirect, 2.0),
        (ProbeLens::SphereMap { wrap: 1.0, circle: None }, 0.8),
    ];
    for (lens, seen_below) in lenses {
        let Some(mut app) = app() else { return };
        let size = if lens == ProbeLens::Equirect { UVec2::new(320, 160) } else { UVec2::splat(220) };
        let pose = Transform::default().looking_to(Vec3::new(0.2, 1.0, 0.1).normalize(), Vec3::NEG_Z);
        let frame =
            picture(size, |pixel| lens.direction(pixel, size).map_or(Vec3::ZERO, |dir| smooth(pose.rotation * dir)));
        let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
        let camera = app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed, pose)).id();
        settle(&mut app);
        assert_eq!(app.world().get::<ProbeCameraState>(camera), Some(&ProbeCameraState::Measuring));
        let cube = read(&mut app);
        let forward = *pose.forward();
        // A sphere map looks at the ball: what it shows best is behind the camera.
        let is_ball = matches!(lens, ProbeLens::SphereMap { .. });
        let (error, darkest) =
            judge(&cube, |dir| if is_ball { -dir.dot(forward) > -seen_below } else { dir.dot(forward) > -seen_below });
        println!("{lens:?}: off by {:.2} %, darkest {darkest:.2}", 100.0 * error);
        assert!(error < LENS_TOLERANCE && darkest > 0.05);
    }
}

#[test]
fn the_gain_of_a_second_camera_applies_to_all_of_its_light() {
    let Some(mut app) = app() else { return };
    let lens = ProbeLens::Equirect;
    let size = UVec2::new(320, 160);
    // Darker than the room, and with another white balance.
    let gain = Vec3::new(2.0, 1.25, 1.6);
    let frame = picture(size, |pixel| lens.direction(pixel, size).map_or(Vec3::ZERO, |dir| smooth(dir) / gain));
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((LightProbeCamera { lens, gain }, feed, Transform::default()));
    settle(&mut app);
    let (error, darkest) = judge(&read(&mut app), |_| true);
    println!("off by {:.2} %, darkest {darkest:.2}", 100.0 * error);
    assert!(error < LENS_TOLERANCE && darkest > 0.05);
}

#[test]
fn a_fisheye_fills_what_the_ball_does_not_show() {
    let Some(mut app) = app() else { return };
    let pose = looking_at(BALL);
    add_camera(&mut app, pose, photograph(pose, |_| false));
    add_ball(&mut app);
    let lens = ProbeLens::default();
    let size = UVec2::splat(200);
    // Looks where the ball hides most.
    let forward = pose.forward();
    let look = Transform::default().looking_to(*forward, Vec3::Y);
    let frame =
        picture(size, |pixel| lens.direction(pixel, size).map_or(Vec3::ZERO, |dir| smooth(look.rotation * dir)));
    settle(&mut app);
    let hidden = |dir: Vec3| dir.dot(*forward) > 0.8;
    let (before, _) = judge(&read(&mut app), hidden);
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed, look));
    settle(&mut app);
    let cube = read(&mut app);
    let ((after, _), (all, _)) = (judge(&cube, hidden), judge(&cube, |_| true));
    println!(
        "behind the ball off by {:.1} % → {:.1} % with a fisheye; everywhere {:.1} %",
        100.0 * before,
        100.0 * after,
        100.0 * all
    );
    assert!(after < LENS_TOLERANCE && after < 0.5 * before && all < BALL_TOLERANCE);
}

#[test]
fn a_lens_that_cannot_be_is_refused_with_a_reason() {
    let Some(mut app) = app() else { return };
    let lens = ProbeLens::Fisheye { projection: FisheyeProjection::Orthographic, fov_degrees: 220.0, circle: None };
    let feed = CameraFeed::pixels(picture(UVec2::splat(16), |_| Vec3::ONE)).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed)).id();
    app.update();
    app.update();
    let state = app.world().get::<ProbeCameraState>(camera);
    assert!(matches!(state, Some(ProbeCameraState::Failed(reason)) if reason.contains("fov_degrees")), "{state:?}");
}
