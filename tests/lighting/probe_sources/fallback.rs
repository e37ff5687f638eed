//! Fallback light without a ball, and the transition to measured light.

use super::{BALL, BALL_TOLERANCE, add_ball, add_camera, app, judge, looking_at, photograph, read, settle, smooth};
use bevy::{light::EnvironmentMapLight, prelude::*};
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels},
    prelude::*,
    probe::{EnvironmentFallback, EnvironmentOrigin},
};
use std::{path::Path, time::Duration};

#[test]
fn without_a_ball_a_sky_is_fitted_to_the_picture_until_one_is_measured() {
    let Some(mut app) = app() else { return };
    let pose = looking_at(BALL);
    let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
    settle(&mut app);
    let origin = |app: &App| app.world().get::<EnvironmentOrigin>(camera).copied();
    assert_eq!(origin(&app), Some(EnvironmentOrigin::FittedSky));
    let cube = read(&mut app);
    let darkest = cube.texels.iter().map(|l| l.min_element()).fold(f32::MAX, f32::min);
    // The desk's 0.3 is taken for a reflectance of 0.4.
    let (up, down) = (cube.sample(Vec3::Y), cube.sample(Vec3::NEG_Y));
    println!("fitted sky: {up} above, {down} below, darkest {darkest:.2}");
    assert!(darkest > 0.1 && up.min_element() > 1.5 * down.max_element());

    add_ball(&mut app);
    settle(&mut app);
    assert_eq!(origin(&app), Some(EnvironmentOrigin::Measured));
    let axis = (pose.translation - BALL).normalize();
    let (error, _) = judge(&read(&mut app), |dir| dir.dot(axis) > -0.6);
    assert!(error < BALL_TOLERANCE, "{error}");
}

#[test]
fn what_is_measured_fades_in_over_what_was_assumed() {
    for (fade, is_measured) in [(Duration::ZERO, true), (Duration::from_secs(3600), false)] {
        let Some(mut app) = app() else { return };
        let pose = looking_at(BALL);
        let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
        let feed = CameraFeed::pixels(photograph(pose, |_| false));
        app.world_mut().entity_mut(camera).insert((feed, EnvironmentFallback { fade, ..default() }));
        settle(&mut app);
        let assumed = read(&mut app).sample(Vec3::Y);
        let probe = add_ball(&mut app);
        settle(&mut app);
        let up = read(&mut app).sample(Vec3::Y);
        println!("{assumed} before, {up} after a fade of {fade:?}, {} in truth", smooth(Vec3::Y));
        let wanted = if is_measured { smooth(Vec3::Y) } else { assumed };
        assert!((up - wanted).abs().max_element() < 0.05);
        // Without its ball, what was measured stays.
        app.world_mut().despawn(probe);
        settle(&mut app);
        assert_eq!(app.world().get::<EnvironmentOrigin>(camera), Some(&EnvironmentOrigin::Measured));
        assert!((read(&mut app).sample(Vec3::Y) - up).abs().max_element() < 0.05);
    }
}

#[test]
fn a_file_lights_the_scene_and_a_missing_one_does_not_stop_it() {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fallback.hdr");
    let texels = vec![Vec3::new(0.7, 0.2, 3.0); 32 * 16];
    EquirectPixels { size: UVec2::new(32, 16), texels }.save(&path).expect("written");
    let cases = [
        (Some(path.clone()), None, EnvironmentOrigin::Saved),
        (Some("missing.hdr".into()), Some(path.clone()), EnvironmentOrigin::File),
        (None, Some("missing.hdr".into()), EnvironmentOrigin::FittedSky),
    ];
    for (saved, file, expected) in cases {
        let Some(mut app) = app() else { return };
        let pose = looking_at(BALL);
        let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
        let fallback = EnvironmentFallback { saved, file, ..default() };
        app.world_mut().entity_mut(camera).insert(fallback);
        settle(&mut app);
        assert_eq!(app.world().get::<EnvironmentOrigin>(camera), Some(&expected));
        let up = read(&mut app).sample(Vec3::Y);
        let is_file = expected != EnvironmentOrigin::FittedSky;
        assert_eq!(is_file, (up - Vec3::new(0.7, 0.2, 3.0)).abs().max_element() < 0.05, "{up}");
    }
}

#[test]
fn a_camera_that_the_game_lights_keeps_that_light() {
    let Some(mut app) = app() else { return };
    let pose = looking_at(BALL);
    let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
    app.world_mut().entity_mut(camera).insert(EnvironmentMapLight::default());
    settle(&mut app);
    assert!(!app.world().entity(camera).contains::<EnvironmentCube>());
}
