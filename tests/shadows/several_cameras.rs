//! Several cameras at one desk: each shows its own frame, also on phantoms; ordinary cameras see virtual things only;
//! and a camera that shows a part of a view shows the same part of the frame.

use crate::drawing;
use bevy::{
    camera::{RenderTarget, SubCameraView, Viewport},
    prelude::*,
};
use bevy_mirrorball::{camera::FramePixels, headless, materials::ShowPhantoms, prelude::*};

/// Rounding to 8 bits.
const SAME: u8 = 1;
const SIZE: UVec2 = UVec2::new(96, 64);
const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(80.0), Vec2::new(48.0, 32.0), SIZE);
const GREEN: [u8; 3] = [0, 255, 0];
/// The engine's clear color.
const CLEAR: [u8; 3] = [43, 44, 47];

/// A frame in which every pixel differs from its neighbors; another one for every number.
fn picture(number: u32) -> Vec<u8> {
    let pixel =
        |i: u32| [(40 + 50 * number + i % 7) as u8, 100 + (i / SIZE.x % 60) as u8, 60 + (i % SIZE.x) as u8, 255];
    (0..SIZE.element_product()).flat_map(pixel).collect()
}

fn pose() -> Transform {
    Transform::from_xyz(0.0, 0.6, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z)
}

/// A phantom desk with a phantom box on it, and a green cube of which the box hides a part.
struct Scene {
    app: App,
}

impl Scene {
    fn new() -> Option<Self> {
        let mut scene = Self { app: drawing::app()? };
        let phantom = PhantomObject { casts: false, ..default() };
        scene.add(Plane3d::default().mesh().size(3.0, 3.0).build(), Vec3::ZERO, phantom);
        scene.add(Cuboid::new(0.1, 0.04, 0.1), Vec3::new(0.05, 0.2, 0.0), phantom);
        let green = StandardMaterial { base_color: Color::srgb(0.0, 1.0, 0.0), unlit: true, ..default() };
        let green = scene.app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(green);
        let cube = (MeshMaterial3d(green), SurfaceStyle::Engine);
        scene.add(Cuboid::new(0.2, 0.05, 0.1), Vec3::new(-0.05, 0.025, 0.0), cube);
        Some(scene)
    }

    fn add(&mut self, mesh: impl Into<Mesh>, place: Vec3, extra: impl Bundle) {
        let mesh = self.app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        self.app.world_mut().spawn((Mesh3d(mesh), Transform::from_translation(place), extra));
    }

    /// A camera that shows the picture of a number, and the image that it renders into.
    fn ar_camera(&mut self, number: u32, size: UVec2, camera: Camera) -> (Entity, Handle<Image>) {
        let (image, target) = headless::add_target(&mut self.app, size);
        let pixels = FramePixels::new(SIZE, picture(number)).expect("as many bytes as the size says");
        let feed = CameraFeed::pixels(pixels).with_pace(FeedPace::Lockstep);
        let bundle = (ArCamera::new(INTRINSICS), camera, pose(), feed, target, Msaa::Off);
        (self.app.world_mut().spawn(bundle).id(), image)
    }

    /// A camera at the same place and with the same projection that has no feed.
    fn ordinary_camera(&mut self, extra: impl Bundle) -> Handle<Image> {
        let (image, target) = headless::add_target(&mut self.app, SIZE);
        let projection =
            Projection::custom(bevy_mirrorball::camera::IntrinsicsProjection::new(INTRINSICS, FrameFit::Cover));
        let clear = Camera { clear_color: Color::BLACK.into(), order: 9, ..default() };
        let look = (bevy::core_pipeline::tonemapping::Tonemapping::None, Msaa::Off);
        self.app.world_mut().spawn((Camera3d::default(), clear, projection, pose(), target, look, extra));
        image
    }

    fn run(&mut self) {
        headless::settle(&mut self.app).expect("all shaders compile");
        for _ in 0..4 {
            self.app.update();
        }
    }

    fn read(&mut self, image: &Handle<Image>) -> Vec<u8> {
        headless::read_texture(&mut self.app, image).expect("the picture comes back")
    }
}

fn is_green(pixel: &[u8]) -> bool {
    pixel[..3] == GREEN
}

/// Largest difference between two pictures, apart from the green cube in the first.
fn difference_beside_green(shown: &[u8], expected: &[u8]) -> u8 {
    let pixels = shown.chunks(4).zip(expected.chunks(4)).filter(|(shown, _)| !is_green(shown));
    pixels.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

fn difference(a: &[u8], b: &[u8]) -> u8 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.abs_diff(*b)).max().unwrap_or(0)
}

fn green_pixels(shown: &[u8]) -> usize {
    shown.chunks(4).filter(|pixel| is_green(pixel)).count()
}

#[test]
fn each_camera_shows_phantoms_with_its_own_frame_from_the_same_place_too() {
    let Some(mut scene) = Scene::new() else { return };
    let images = [0, 1, 2].map(|i| scene.ar_camera(i, SIZE, Camera { order: i as isize, ..default() }).1);
    scene.run();
    let shown = images.map(|image| scene.read(&image));
    for (i, shown) in shown.iter().enumerate() {
        let worst = difference_beside_green(shown, &picture(i as u32));
        println!("camera {i}: off by {worst}/255, {} pixels of the cube", green_pixels(shown));
        assert!(worst <= SAME);
        assert_eq!(green_pixels(shown), green_pixels(&pictures_of_one_camera()), "the box hides a part of the cube");
    }
}

/// What a single camera shows.
fn pictures_of_one_camera() -> Vec<u8> {
    let mut scene = Scene::new().expect("there was a GPU a moment ago");
    let (_, image) = scene.ar_camera(0, SIZE, Camera::default());
    scene.run();
    scene.read(&image)
}

#[test]
fn halves_of_a_split_screen_show_two_feeds() {
    let Some(mut scene) = Scene::new() else { return };
    let half = |number: u32| Camera {
        order: number as isize,
        viewport: Some(Viewport {
            physical_position: UVec2::new(48 * number, 0),
            physical_size: UVec2::new(48, 64),
            ..default()
        }),
        // As in Bevy's own split screen: the first camera has cleared the whole target.
        clear_color: if number == 0 { default() } else { ClearColorConfig::None },
        ..default()
    };
    let (first, image) = scene.ar_camera(0, SIZE, half(0));
    let (second, _) = scene.ar_camera(1, SIZE, half(1));
    let target = scene.app.world().get::<RenderTarget>(first).expect("it has one").clone();
    scene.app.world_mut().entity_mut(second).insert(target);
    scene.run();
    let shown = scene.read(&image);
    // The middle of the frame fills each half.
    let expected: Vec<u8> = (0..SIZE.element_product())
        .flat_map(|i| {
            let (x, y) = (i % SIZE.x, i / SIZE.x);
            let at = (4 * (y * SIZE.x + 24 + x % 48)) as usize;
            picture(x / 48)[at..at + 4].to_vec()
        })
        .collect();
    let worst = difference_beside_green(&shown, &expected);
    println!("split screen: off by {worst}/255, {} pixels of the cube", green_pixels(&shown));
    assert!(worst <= SAME && green_pixels(&shown) > 200);
}

#[test]
fn ordinary_cameras_see_virtual_things_only_unless_they_are_to_show_phantoms() {
    let Some(mut scene) = Scene::new() else { return };
    let (camera, ar) = scene.ar_camera(0, SIZE, Camera::default());
    let plain = scene.ordinary_camera(());
    let showing = scene.ordinary_camera(ShowPhantoms::default());
    let of_another = scene.ordinary_camera(ShowPhantoms { projector: Some(Entity::PLACEHOLDER) });
    scene.run();
    let [ar, plain, showing, of_another] = [ar, plain, showing, of_another].map(|image| scene.read(&image));
    let (whole, hidden) = (green_pixels(&plain), green_pixels(&ar));
    println!("the cube has {whole} pixels, {hidden} of them beside the box");
    assert!(hidden > 100 && whole > hidden + 50, "without phantoms the cube is seen whole");
    assert!(plain.chunks(4).all(|pixel| is_green(pixel) || pixel[..3] == [0, 0, 0]), "nothing of the frame");
    let worst = difference(&ar, &showing);
    println!("projected from the same place: off by {worst}/255");
    assert!(worst <= 2 * SAME);
    assert_eq!(of_another, plain, "a projector that does not exist shows nothing");

    // The real camera goes, and its frame with it.
    let image = scene.ordinary_camera(ShowPhantoms::default());
    scene.app.world_mut().despawn(camera);
    scene.run();
    assert_eq!(scene.read(&image), plain);
}

#[test]
fn tiles_of_a_view_put_together_are_the_whole() {
    let Some(mut scene) = Scene::new() else { return };
    let (_, whole) = scene.ar_camera(0, SIZE, Camera::default());
    let mut tiles = Vec::new();
    // Four quarters, and two halves of another shape than the whole.
    for (columns, rows) in [(2, 2), (2, 1), (1, 2)] {
        let size = SIZE / UVec2::new(columns, rows);
        for corner in (0..rows).flat_map(|row| (0..columns).map(move |column| UVec2::new(column, row) * size)) {
            let part = SubCameraView { full_size: SIZE, offset: corner.as_vec2(), size };
            let camera = Camera { sub_camera_view: Some(part), order: tiles.len() as isize, ..default() };
            tiles.push((corner, size, scene.ar_camera(0, size, camera).1));
        }
    }
    scene.run();
    let whole = scene.read(&whole);
    assert!(green_pixels(&whole) > 100);
    for (corner, size, tile) in tiles {
        let tile = scene.read(&tile);
        let row = |y: u32| (4 * ((corner.y + y) * SIZE.x + corner.x)) as usize;
        let part: Vec<u8> = (0..size.y).flat_map(|y| whole[row(y)..][..4 * size.x as usize].to_vec()).collect();
        let worst = difference(&tile, &part);
        println!("{size} at {corner}: off by {worst}/255");
        assert!(worst <= SAME);
    }
}

/// Soft shadows that are interpolated from samples.
const INTERPOLATED: u8 = 2;

#[test]
fn a_viewport_shows_what_a_view_of_its_size_shows() {
    let inset = Viewport { physical_position: UVec2::new(16, 8), physical_size: UVec2::new(64, 48), ..default() };
    for has_dome in [false, true] {
        let Some(mut scene) = Scene::new() else { return };
        if has_dome {
            scene.app.world_mut().spawn(ShadowDomeLight::default());
        }
        let (camera, alone) = scene.ar_camera(0, inset.physical_size, Camera::default());
        scene.run();
        let alone = scene.read(&alone);
        scene.app.world_mut().despawn(camera);
        let camera = Camera { viewport: Some(inset.clone()), clear_color: Color::BLACK.into(), ..default() };
        let (_, image) = scene.ar_camera(0, SIZE, camera);
        scene.run();
        let shown = scene.read(&image);
        let row = |y: u32| (4 * ((8 + y) * SIZE.x + 16)) as usize;
        let part: Vec<u8> = (0..48).flat_map(|y| shown[row(y)..][..4 * 64].to_vec()).collect();
        let worst = difference(&part, &alone);
        println!("dome {has_dome}: off by {worst}/255");
        assert!(worst <= if has_dome { INTERPOLATED } else { SAME });
        assert_eq!(shown[..3], CLEAR, "nothing beside the viewport");
    }
}
