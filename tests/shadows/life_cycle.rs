//! Parts of a scene that come and go: afterwards the picture is what it was, and nothing ends the game in between.

use crate::{
    desk::{Desk, INTRINSICS, SIZE, Shot, desk_picture},
    gpu,
};
use bevy::{
    camera::RenderTarget,
    prelude::*,
    render::{render_resource::Extent3d, renderer::RenderDevice},
    window::{WindowRef, WindowResolution},
};
use bevy_mirrorball::{
    camera::{CameraFrame, FramePixels},
    headless::{self, HeadlessError},
    phantom::StageRole,
    prelude::*,
    probe::UniformSky,
    tracking::{MarkerState, MarkerTracking},
};
use std::time::Duration;

/// Rounding to 8 bits.
const ALIKE: u8 = 1;
/// The box and its shadow change the picture by more.
const DIFFERENT: u8 = 20;
const PLACE: Vec3 = Vec3::new(0.0, 0.03, 0.0);

/// The desk with a box on it, and its picture.
fn desk_with_box() -> Option<(Desk, Entity, Shot)> {
    let mut desk = Desk::new()?;
    let thing = desk.add_virtual(Cuboid::from_length(0.06), PLACE);
    headless::settle(&mut desk.app).expect("all shaders compile");
    let shot = desk.shoot();
    Some((desk, thing, shot))
}

fn feed() -> CameraFeed {
    let pixels = FramePixels::new(SIZE, desk_picture()).expect("as many bytes as the size says");
    CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep)
}

fn pose() -> Transform {
    Transform::from_xyz(0.0, crate::desk::HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z)
}

fn ball() -> impl Bundle {
    let sky = UniformSky { radiance: Some(Vec3::splat(crate::desk::SKY)) };
    (LightProbeSphere::default(), sky, Transform::from_xyz(0.2, 0.05, 0.1))
}

/// Updates with a part missing, and then, with it again, checks the picture.
fn check(name: &str, desk: &mut Desk, before: &Shot, bring_back: impl FnOnce(&mut Desk)) {
    for _ in 0..4 {
        headless::update(&mut desk.app).expect("rendering goes on");
    }
    bring_back(desk);
    let after = desk.shoot();
    let difference = after.difference(&before.0);
    println!("{name}: {difference}/255");
    assert!(difference <= ALIKE, "{name} came back and the picture differs by {difference}/255");
}

#[test]
fn what_is_despawned_and_spawned_again_looks_as_before() {
    let Some((mut desk, thing, before)) = desk_with_box() else { return };
    desk.app.world_mut().despawn(thing);
    check("box", &mut desk, &before, |desk| {
        desk.add_virtual(Cuboid::from_length(0.06), PLACE);
    });
    desk.app.world_mut().despawn(desk.dome);
    check("dome", &mut desk, &before, |desk| {
        desk.dome = desk.app.world_mut().spawn(ShadowDomeLight { surfels: 0, ..default() }).id();
    });
    desk.app.world_mut().despawn(desk.probe);
    check("ball", &mut desk, &before, |desk| {
        desk.probe = desk.app.world_mut().spawn(ball()).id();
    });
    desk.app.world_mut().despawn(desk.plane);
    check("desk", &mut desk, &before, |desk| {
        let sheet = Plane3d::default().mesh().size(2.0, 2.0).build();
        desk.plane = desk.add(sheet, Vec3::ZERO, PhantomObject { casts: false, ..default() });
    });
    desk.app.world_mut().entity_mut(desk.camera).remove::<CameraFeed>();
    check("feed", &mut desk, &before, |desk| {
        desk.app.world_mut().entity_mut(desk.camera).insert(feed());
    });
    let target = desk.app.world().get::<RenderTarget>(desk.camera).cloned().expect("a camera has one");
    desk.app.world_mut().despawn(desk.camera);
    check("camera", &mut desk, &before, |desk| {
        desk.camera = desk.app.world_mut().spawn((ArCamera::new(INTRINSICS), pose(), feed(), target, Msaa::Off)).id();
    });
}

#[test]
fn a_whole_scene_that_a_state_leaves_and_enters_again_looks_as_before() {
    let Some((mut desk, _, before)) = desk_with_box() else { return };
    for round in 0..2 {
        let target = desk.app.world().get::<RenderTarget>(desk.camera).cloned().expect("a camera has one");
        let world = desk.app.world_mut();
        let all: Vec<Entity> = world
            .query_filtered::<Entity, Or<(With<StageRole>, With<ArCamera>, With<ShadowDomeLight>, With<UniformSky>)>>()
            .iter(world)
            .collect();
        for entity in all {
            world.despawn(entity);
        }
        check(&format!("everything, round {round}"), &mut desk, &before, |desk| {
            let sheet = Plane3d::default().mesh().size(2.0, 2.0).build();
            desk.plane = desk.add(sheet, Vec3::ZERO, PhantomObject { casts: false, ..default() });
            desk.add_virtual(Cuboid::from_length(0.06), PLACE);
            let world = desk.app.world_mut();
            desk.dome = world.spawn(ShadowDomeLight { surfels: 0, ..default() }).id();
            desk.probe = world.spawn(ball()).id();
            desk.camera = world.spawn((ArCamera::new(INTRINSICS), pose(), feed(), target, Msaa::Off)).id();
        });
    }
}

#[test]
fn what_is_hidden_or_switched_off_for_a_while_looks_as_before() {
    let Some((mut desk, thing, before)) = desk_with_box() else { return };
    desk.app.world_mut().entity_mut(thing).insert(Visibility::Hidden);
    let hidden = desk.shoot();
    assert!(hidden.difference(&desk_picture()) <= ALIKE, "hidden, it is seen or casts a shadow");
    check("hidden box", &mut desk, &before, |desk| {
        desk.app.world_mut().entity_mut(thing).insert(Visibility::Inherited);
    });
    desk.app.world_mut().entity_mut(desk.plane).insert(Visibility::Hidden);
    check("hidden desk", &mut desk, &before, |desk| {
        desk.app.world_mut().entity_mut(desk.plane).insert(Visibility::Inherited);
    });
    let switch = |desk: &mut Desk, is_active: bool| {
        desk.app.world_mut().get_mut::<Camera>(desk.camera).expect("a camera is one").is_active = is_active;
    };
    switch(&mut desk, false);
    check("camera switched off", &mut desk, &before, |desk| switch(desk, true));
}

#[test]
fn a_target_of_other_sizes_for_a_while_changes_nothing_afterwards() {
    let Some((mut desk, _, before)) = desk_with_box() else { return };
    let resize = |desk: &mut Desk, size: UVec2| {
        let mut images = desk.app.world_mut().resource_mut::<Assets<Image>>();
        let mut target = images.get_mut(&desk.picture).expect("it is drawn into");
        target.resize(Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 });
    };
    for size in [UVec2::new(33, 97), UVec2::ONE, UVec2::new(400, 8)] {
        resize(&mut desk, size);
        check(&format!("{size}"), &mut desk, &before, |desk| resize(desk, SIZE));
    }
}

#[test]
fn a_minimized_window_changes_nothing_afterwards() {
    let Some((mut desk, _, before)) = desk_with_box() else { return };
    let original = desk.app.world().get::<RenderTarget>(desk.camera).cloned().expect("a camera has one");
    for size in [UVec2::new(64, 48), UVec2::ZERO, UVec2::new(64, 48)] {
        let resolution = WindowResolution::new(size.x, size.y);
        let window = desk.app.world_mut().spawn(Window { resolution, ..default() }).id();
        desk.app.world_mut().entity_mut(desk.camera).insert(RenderTarget::Window(WindowRef::Entity(window)));
        for _ in 0..4 {
            headless::update(&mut desk.app).expect("rendering goes on");
        }
        desk.app.world_mut().despawn(window);
    }
    let camera = desk.camera;
    check("window of no pixels", &mut desk, &before, |desk| {
        desk.app.world_mut().entity_mut(camera).insert(original);
    });
}

#[test]
fn a_lost_device_ends_the_game_with_an_error_and_hangs_nothing() {
    let Some((mut desk, _, _)) = desk_with_box() else { return };
    desk.app.world().resource::<RenderDevice>().wgpu_device().destroy();
    let lost = headless::update_until(&mut desk.app, "losing the device", Duration::from_secs(60), |_| false);
    println!("{lost:?}");
    assert!(matches!(lost, Err(HeadlessError::Stopped)), "{lost:?}");
    // Whoever goes on in spite of that does without pictures.
    for _ in 0..4 {
        desk.app.update();
    }
    let reading = headless::read_texture(&mut desk.app, &desk.picture);
    assert!(reading.is_err(), "there is nothing to read from");
}

/// The shipped desk in a small view: its scene, and the photograph that shows marker and ball.
struct Shipped {
    app: App,
    picture: Handle<Image>,
    scene: Handle<WorldAsset>,
}

impl Shipped {
    const VIEW: UVec2 = UVec2::new(160, 120);

    fn new() -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins(MirrorballPlugins);
        })?;
        let (picture, target) = headless::add_target(&mut app, Self::VIEW);
        let size = UVec2::new(640, 480);
        let intrinsics = Intrinsics::new(Vec2::splat(601.83), 0.5 * size.as_vec2(), size);
        let feed = CameraFeed::file("assets/desk/photo.jpg").with_pace(FeedPace::Lockstep);
        app.world_mut().spawn((ArCamera::new(intrinsics), feed, target, Msaa::Off));
        app.world_mut().spawn(ShadowDomeLight { directions: 16, ..default() });
        let server = app.world().resource::<AssetServer>();
        let scene = server.load(GltfAssetLabel::Scene(0).from_asset("desk/desk.glb"));
        Some(Self { app, picture, scene })
    }

    /// A picture as soon as the marker is tracked and everything has settled.
    fn shoot(&mut self) -> Shot {
        headless::update_until(&mut self.app, "tracking the marker", Duration::from_secs(60), |app| {
            let world = app.world_mut();
            world.query::<&MarkerTracking>().iter(world).any(|tracking| tracking.state == MarkerState::Tracked)
        })
        .expect("the marker is in the photograph");
        headless::settle(&mut self.app).expect("all shaders compile");
        for _ in 0..12 {
            headless::update(&mut self.app).expect("rendering goes on");
        }
        Shot(headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back"))
    }
}

#[test]
fn a_scene_with_marker_and_ball_that_is_spawned_again_is_tracked_and_lit_again() {
    let Some(mut shipped) = Shipped::new() else { return };
    let scene = shipped.app.world_mut().spawn(WorldAssetRoot(shipped.scene.clone())).id();
    let before = shipped.shoot();
    shipped.app.world_mut().despawn(scene);
    for _ in 0..6 {
        headless::update(&mut shipped.app).expect("rendering goes on");
    }
    let world = shipped.app.world_mut();
    assert_eq!(world.query::<&MarkerAnchor>().iter(world).count(), 0);
    assert_eq!(world.query::<&CameraFrame>().iter(world).count(), 1, "the camera goes on");
    let empty = Shot(headless::read_texture(&mut shipped.app, &shipped.picture).expect("the picture comes back"));
    assert!(empty.difference(&before.0) >= DIFFERENT, "the virtual things stayed");
    shipped.app.world_mut().spawn(WorldAssetRoot(shipped.scene.clone()));
    let after = shipped.shoot();
    let difference = after.difference(&before.0);
    println!("scene again: {difference}/255");
    // Poses are refined from where the marker was last.
    assert!(difference <= 3 * ALIKE, "off by {difference}/255");
}
