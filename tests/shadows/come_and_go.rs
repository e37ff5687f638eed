//! Cameras, probes and things that are despawned leave nothing in the render world and on the graphics device.

use crate::{
    desk::{Desk, desk_picture},
    drawing,
};
use bevy::{
    prelude::*,
    render::{
        RenderApp, render_asset::RenderAssets, render_resource::PollType, renderer::RenderDevice,
        storage::GpuShaderBuffer, texture::GpuImage,
    },
};
use bevy_mirrorball::{
    camera::FramePixels, debug::device_memory, headless, materials::ShowPhantoms, prefilter::SceneProbe, prelude::*,
};

const ROUNDS: usize = 50;
/// Rounds after which everything that is allocated once has been allocated.
const WARM_UP: usize = 5;
/// Rounds at the beginning and at the end whose largest memory is compared: drivers free what they no longer use some
/// frames later.
const SPAN: usize = 15;
/// Some buffers are as long as what they held last.
const MEMORY_TOLERANCE: f64 = 1e-3;
const SIZE: UVec2 = UVec2::new(32, 24);

/// Numbers of entities, images and shader buffers in the render world, of images and meshes in the main world, and
/// bytes of this crate on the graphics device.
fn sizes(app: &mut App) -> [u64; 6] {
    let images_in_main = app.world().resource::<Assets<Image>>().len();
    let meshes = app.world().resource::<Assets<Mesh>>().len();
    let world = app.sub_app_mut(RenderApp).world_mut();
    // What the device still draws with is freed when it is done.
    world.resource::<RenderDevice>().poll(PollType::wait_indefinitely()).expect("the device is there");
    let memory = device_memory(world.resource::<RenderDevice>()).unwrap_or_default();
    let entities = world.query::<Entity>().iter(world).count();
    let images = world.resource::<RenderAssets<GpuImage>>().iter().count();
    let buffers = world.resource::<RenderAssets<GpuShaderBuffer>>().iter().count();
    let [entities, images, buffers] = [entities, images, buffers].map(|count| count as u64);
    [entities, images, buffers, images_in_main as u64, meshes as u64, memory.iter().map(|part| part.bytes).sum()]
}

/// Spawns something, draws it, despawns it, and looks at what is left, many times.
fn assert_nothing_is_left(app: &mut App, spawn: impl Fn(&mut App) -> Vec<Entity>) {
    let mut left = Vec::new();
    for _ in 0..ROUNDS {
        let spawned = spawn(app);
        for _ in 0..2 {
            app.update();
        }
        for entity in spawned {
            app.world_mut().despawn(entity);
        }
        // Assets whose last handle is gone are freed one update later, what the device still uses after that.
        for _ in 0..3 {
            app.update();
        }
        left.push(sizes(app));
    }
    let settled = &left[WARM_UP..];
    println!("{:?} … {:?}", settled[0], settled[settled.len() - 1]);
    for (i, size) in settled.iter().enumerate() {
        assert_eq!(size[..5], settled[0][..5], "after round {}", i + WARM_UP);
    }
    let most = |rounds: &[[u64; 6]]| rounds.iter().map(|size| size[5]).max().unwrap_or_default() as f64;
    let (first, last) = (most(&settled[..SPAN]), most(&settled[settled.len() - SPAN..]));
    assert!(last <= (1.0 + MEMORY_TOLERANCE) * first, "{first} bytes have become {last}");
}

fn ar_camera(app: &mut App, order: isize) -> Entity {
    let (_, target) = headless::add_target(app, SIZE);
    let pixels = FramePixels::new(SIZE, vec![90; 4 * SIZE.element_product() as usize]).expect("fits");
    let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
    let place = Transform::from_xyz(0.0, 0.6, 0.1).looking_at(Vec3::ZERO, Vec3::NEG_Z);
    let intrinsics = Intrinsics::from_horizontal_fov(SIZE, 1.0);
    app.world_mut().spawn((ArCamera::new(intrinsics), Camera { order, ..default() }, place, feed, target)).id()
}

#[test]
fn cameras_beside_another_one_leave_nothing() {
    let Some(mut desk) = Desk::new() else { return };
    let before = desk.shoot();
    assert_nothing_is_left(&mut desk.app, |app| {
        let (_, target) = headless::add_target(app, SIZE);
        let spectator = (Camera3d::default(), Camera { order: 2, ..default() }, target, ShowPhantoms::default());
        vec![ar_camera(app, 1), app.world_mut().spawn(spectator).id()]
    });
    assert!(desk.shoot().difference(&before.0) <= 1, "the other camera shows what it did");
}

#[test]
fn balls_domes_probes_phantoms_and_virtual_things_leave_nothing() {
    let Some(mut app) = drawing::app() else { return };
    ar_camera(&mut app, 0);
    headless::settle(&mut app).expect("all shaders compile");
    assert_nothing_is_left(&mut app, |app| {
        let mut meshes = app.world_mut().resource_mut::<Assets<Mesh>>();
        let mut mesh = || Mesh3d(meshes.add(Cuboid::from_length(0.1)));
        let [thing, toon, phantom] = [(); 3].map(|()| mesh());
        let mut materials = app.world_mut().resource_mut::<Assets<StandardMaterial>>();
        let [plain, flat] = [Color::WHITE, Color::BLACK].map(|color| MeshMaterial3d(materials.add(color)));
        let world = app.world_mut();
        vec![
            world.spawn((thing, plain)).id(),
            world.spawn((toon, flat, SurfaceStyle::Toon(ToonStyle::default()))).id(),
            world.spawn((phantom, PhantomObject::default())).id(),
            world.spawn((LightProbeSphere::default(), Transform::from_xyz(0.1, 0.05, 0.0))).id(),
            world.spawn((LightProbe::default(), SceneProbe { edge: 16, ..default() })).id(),
            world.spawn(ShadowDomeLight { directions: 16, resolution: 32, ..default() }).id(),
        ]
    });
}

#[test]
fn whole_cameras_leave_nothing() {
    let Some(mut desk) = Desk::new() else { return };
    desk.app.world_mut().despawn(desk.camera);
    assert_nothing_is_left(&mut desk.app, |app| vec![ar_camera(app, 0)]);
}

#[test]
fn a_camera_without_feed_and_frame_shows_neither() {
    let Some(mut desk) = Desk::new() else { return };
    assert!(desk.shoot().difference(&desk_picture()) <= 1);
    desk.app.world_mut().entity_mut(desk.camera).remove::<(CameraFeed, CameraFrame)>();
    desk.app.world_mut().get_mut::<Camera>(desk.camera).expect("it is one").clear_color = Color::BLACK.into();
    let shown = desk.shoot();
    assert!(shown.0.chunks(4).all(|pixel| pixel[..3] == [0, 0, 0]), "an old frame is shown");
    let pixels = FramePixels::new(crate::desk::SIZE, desk_picture()).expect("fits");
    let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
    desk.app.world_mut().entity_mut(desk.camera).insert(feed);
    assert!(desk.shoot().difference(&desk_picture()) <= 1, "a new feed is shown");
}
