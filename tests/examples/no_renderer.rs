//! A game without a graphics adapter, as on a server: poses and scene logic go on, nothing panics.

use bevy::{
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderPlugin,
        settings::{RenderCreation, WgpuSettings},
    },
};
use bevy_mirrorball::{camera::FramePixels, offscreen, phantom::StageRole, prelude::*, tracking::MarkerTracking};

#[test]
fn without_a_renderer_everything_else_works() {
    let no_renderer = RenderPlugin {
        render_creation: RenderCreation::Automatic(Box::new(WgpuSettings { backends: None, ..default() })),
        ..default()
    };
    let mut app = offscreen::build_app(offscreen::default_plugins().set(no_renderer), |app| {
        app.add_plugins(MirrorballPlugins);
    })
    .expect("an app without renderer needs no adapter");
    let picture = FramePixels::new(UVec2::new(64, 48), vec![128; 64 * 48 * 4]).expect("fits");
    let world = app.world_mut();
    world.spawn((
        ArCamera::default(),
        RenderTarget::default(),
        CameraFeed::pixels(picture).with_pace(FeedPace::Lockstep),
    ));
    let anchor = world.spawn((MarkerAnchor::new(0, 0.1), WorldOrigin)).id();
    world.spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 0.0, -0.5)));
    world.spawn(ShadowDomeLight::default());
    let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::default());
    let phantom = world.spawn((PhantomObject::default(), Mesh3d(mesh))).id();
    for _ in 0..5 {
        app.update();
    }
    assert!(matches!(app.world().get::<StageRole>(phantom), Some(StageRole::Phantom(_))));
    assert_eq!(app.world().get::<MarkerTracking>(anchor).and_then(|tracking| tracking.last_seen), None);
}
