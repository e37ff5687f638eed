//! What several cameras are told.

use crate::{
    drawing,
    logged::{log_of, warnings},
};
use bevy::{log::LogPlugin, prelude::*};
use bevy_mirrorball::{headless, prelude::*};

const SIZE: UVec2 = UVec2::new(32, 24);

#[test]
fn each_camera_without_a_visibility_pass_is_named_once() {
    let Some(log) = log_of("unserved_cameras::each_camera_without_a_visibility_pass_is_named_once") else {
        return draw_with_three_cameras();
    };
    // Where there is nothing to render with, there is nothing to be told.
    let Some((_, named)) = log.split_once("cameras ") else {
        assert!(log.contains("skipped"), "{log}");
        return;
    };
    let named: Vec<&str> = named.lines().next().expect("a line").split(' ').collect();
    let [served, second, third] = named[..] else { panic!("{named:?}") };
    for other in [second, third] {
        let words = [&*format!("camera {other}: the visibility pass"), &*format!("which is {served}")];
        assert_eq!(warnings(&log, &words), 1, "{log}");
    }
    assert_eq!(warnings(&log, &["visibility pass"]), 2, "{log}");
}

fn draw_with_three_cameras() {
    let Some(mut app) = drawing::app_with(|app| {
        app.add_plugins(LogPlugin::default());
    }) else {
        return;
    };
    let cameras = [0, 1, 2].map(|order| {
        let (_, target) = headless::add_target(&mut app, SIZE);
        app.world_mut().spawn((ArCamera::default(), Camera { order, ..default() }, target)).id()
    });
    app.world_mut().spawn(ShadowDomeLight { directions: 4, ..default() });
    for _ in 0..4 {
        app.update();
    }
    println!("cameras {} {} {}", cameras[0], cameras[1], cameras[2]);
}
