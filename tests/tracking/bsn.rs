//! Scenes in Bevy's scene notation.

use bevy::{prelude::*, scene::ScenePlugin};
use bevy_mirrorball::{
    camera::{FeedState, FeedStatistics},
    debug::{MapView, ShownMap},
    prefilter::{DeskParallax, Refresh, SceneProbe},
    prelude::*,
    shadows::{DomeLights, LightsFile},
    tracking::{MarkerFamily, MarkerFound, MarkerTracking},
};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), ImagePlugin::default(), TransformPlugin, ScenePlugin))
        .init_asset::<LightsFile>();
    app
}

fn desk() -> impl Scene {
    bsn! {
        MarkerAnchor { family: MarkerFamily::Tag25h9, id: 3 }
        WorldOrigin
        Children [
            (LightProbeSphere { radius: 0.04 } Transform::from_xyz(0.17, 0.04, 0.01)),
            (PhantomObject { casts: false }),
            (SurfaceStyle::Toon(ToonStyle { bands: 2 })),
            SurfaceStyle,
            ShadowDomeLight,
        ]
    }
}

#[test]
fn what_a_scene_leaves_out_has_its_default() {
    let mut app = app();
    let desk = app.world_mut().spawn_scene(desk()).expect("a scene").id();
    let world = app.world();
    let expected = MarkerAnchor::new(3, 0.1).with_family(MarkerFamily::Tag25h9);
    assert_eq!(world.get::<MarkerAnchor>(desk), Some(&expected));
    assert!(world.get::<WorldOrigin>(desk).is_some() && world.get::<MarkerTracking>(desk).is_some());
    let children: Vec<Entity> = world.get::<Children>(desk).expect("it has some").iter().collect();
    let [ball, phantom, toon, plain, dome] = children[..] else { panic!("{children:?}") };
    assert_eq!(world.get(ball), Some(&LightProbeSphere { radius: 0.04, ..default() }));
    assert_eq!(world.get(ball), Some(&Transform::from_xyz(0.17, 0.04, 0.01)));
    assert_eq!(world.get(phantom), Some(&PhantomObject { casts: false, ..default() }));
    assert_eq!(world.get(toon), Some(&SurfaceStyle::Toon(ToonStyle { bands: 2, ..default() })));
    assert_eq!(world.get(plain), Some(&SurfaceStyle::default()));
    assert_eq!(world.get(dome), Some(&ShadowDomeLight::default()));
}

#[derive(Resource, Default)]
struct Seen(Vec<Entity>);

#[test]
fn a_camera_has_a_feed_and_an_anchor_an_observer() {
    let mut app = app();
    app.init_resource::<Seen>();
    let world = app.world_mut();
    let camera = bsn! {
        ArCamera { intrinsics: {Some(Intrinsics::from_horizontal_fov(UVec2::new(640, 480), 1.0))} }
        CameraFeed::clip("assets/desk_clip")
    };
    let camera = world.spawn_scene(camera).expect("a scene").id();
    let size = world.get::<ArCamera>(camera).and_then(|camera| camera.intrinsics).map(|intrinsics| intrinsics.size);
    assert_eq!(size, Some(UVec2::new(640, 480)));
    assert!(world.get::<CameraFeed>(camera).is_some_and(|feed| format!("{feed:?}").contains("assets/desk_clip")));
    assert!(world.get::<FeedState>(camera).is_some() && world.get::<FeedStatistics>(camera).is_some());

    let anchor = bsn! {
        MarkerAnchor::new(7, 0.04)
        on(|found: On<MarkerFound>, mut seen: ResMut<Seen>| seen.0.push(found.entity))
    };
    let anchor = world.spawn_scene(anchor).expect("a scene").id();
    assert_eq!(world.get(anchor), Some(&MarkerAnchor::new(7, 0.04)));
    world.trigger(MarkerFound { entity: anchor, marker: 7.into(), camera: None });
    assert_eq!(world.resource::<Seen>().0, [anchor]);
}

#[test]
fn handles_are_given_as_paths() {
    let mut app = app();
    let world = app.world_mut();
    let scene = bsn! {
        LiveEnvironment { source: "desk/sky.hdr", refresh: Refresh::OnChange }
        DomeLights("desk/desk.lights.ron")
        DeskParallax { height: 0.7 }
    };
    let entity = world.spawn_scene(scene).expect("a scene").id();
    let path = |path: Option<bevy::asset::AssetPath>| path.map(|path| path.to_string());
    let environment = world.get::<LiveEnvironment>(entity).expect("in the scene");
    let lights = world.get::<DomeLights>(entity).expect("in the scene");
    assert_eq!(path(environment.source.path().cloned()).as_deref(), Some("desk/sky.hdr"));
    assert_eq!(environment.refresh, Refresh::OnChange);
    assert_eq!(path(lights.0.path().cloned()).as_deref(), Some("desk/desk.lights.ron"));
    assert_eq!(world.get(entity), Some(&DeskParallax { height: 0.7, ..default() }));

    let probe = world.spawn_scene(bsn! { SceneProbe { edge: 64 } }).expect("a scene").id();
    let probe = world.get::<SceneProbe>(probe).expect("in the scene");
    assert_eq!((probe.edge, probe.faces_per_frame, probe.far), (64, 1, 100.0), "the others have their defaults");
    let view = world.spawn_scene(bsn! { MapView { map: ShownMap::Diffuse } }).expect("a scene").id();
    assert_eq!(world.get::<MapView>(view).map(|view| view.map), Some(ShownMap::Diffuse));
}

#[test]
fn a_feed_without_a_source_waits() {
    let mut app = app();
    app.add_plugins(bevy_mirrorball::camera::CameraPlugin);
    let camera = app.world_mut().spawn_scene(bsn! { ArCamera CameraFeed }).expect("a scene").id();
    app.update();
    app.update();
    assert_eq!(app.world().get(camera), Some(&FeedState::Waiting));
    assert!(!app.world().entity(camera).contains::<CameraFrame>());
}
