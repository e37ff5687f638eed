//! Shorter exposures of a camera that does not measure the ball.

use crate::logged::{log_of, warnings};
use bevy::{log::LogPlugin, prelude::*};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    lighting::LightingPlugin,
    prelude::*,
    probe::ProbePlugin,
};

const SIZE: UVec2 = UVec2::new(64, 48);

#[test]
fn a_camera_whose_shorter_exposures_are_not_used_is_named_once() {
    let Some(log) = log_of("unused_brackets::a_camera_whose_shorter_exposures_are_not_used_is_named_once") else {
        return bracket_two_cameras();
    };
    let named =
        log.split_once("cameras ").and_then(|(_, named)| named.lines().next()).expect("the other process says it");
    let (measuring, other) = named.split_once(' ').expect("two cameras");
    let words = [&*format!("camera {other}: its shorter exposures"), &*format!("camera {measuring} measures")];
    assert_eq!(warnings(&log, &words), 1, "{log}");
    assert_eq!(warnings(&log, &["shorter exposures"]), 1, "{log}");
}

fn bracket_two_cameras() {
    let mut app = App::new();
    app.add_plugins((LogPlugin::default(), MinimalPlugins, AssetPlugin::default(), ImagePlugin::default()))
        .add_plugins(TransformPlugin)
        .init_asset::<Shader>()
        .add_plugins((CameraPlugin, ProbePlugin, LightingPlugin));
    app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 0.0, -0.3)));
    let intrinsics = Intrinsics::from_horizontal_fov(SIZE, 1.0);
    let cameras =
        [0, 1].map(|order| app.world_mut().spawn((ArCamera::new(intrinsics), Camera { order, ..default() })).id());
    let feed = |exposure| {
        let pixels = FramePixels::new(SIZE, vec![128; 4 * SIZE.element_product() as usize]).expect("fits");
        CameraFeed::pixels(pixels).with_exposure(exposure).with_pace(FeedPace::Lockstep)
    };
    for exposure in [1.0, 0.25, 1.0, 0.25, 1.0] {
        for camera in cameras {
            app.world_mut().entity_mut(camera).insert(feed(exposure));
        }
        app.update();
    }
    println!("cameras {} {}", cameras[0], cameras[1]);
}
