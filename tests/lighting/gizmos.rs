//! Lines that show what the crate knows of the scene.

use crate::gpu;
use bevy::prelude::*;
use bevy_gizmos_render::GizmoRenderPlugin;
use bevy_mirrorball::{
    camera::FramePixels, debug::MirrorballGizmos, headless, lighting::RealLight, prelude::*, tracking::MarkerBoard,
};

const SIZE: UVec2 = UVec2::new(320, 240);
const BALL: Vec3 = Vec3::new(0.17, 0.05, 0.01);
/// A line is two pixels wide, and lies between two rows or columns.
const LINE_PIXELS: f32 = 2.0;
/// Value of all pixels of the camera's frame.
const FRAME: u8 = 20;
/// Difference of a pixel from which on something is drawn there. What is behind the lines may change by less.
const MIN_CHANGE: u8 = 24;

/// A desk with one of everything, in front of an `ArCamera` whose frame is dark.
struct Desk {
    app: App,
    picture: Handle<Image>,
    intrinsics: Intrinsics,
    camera_from_world: Mat4,
}

impl Desk {
    fn new() -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins((GizmoRenderPlugin, MirrorballPlugins));
        })?;
        let (picture, target) = headless::add_target(&mut app, SIZE);
        let intrinsics = Intrinsics::from_horizontal_fov(SIZE, 0.9);
        let eye = Transform::from_xyz(0.15, 0.45, 0.6).looking_at(Vec3::new(0.08, 0.03, 0.0), Vec3::Y);
        let world = app.world_mut();
        let frame = FramePixels::new(SIZE, [FRAME, FRAME, FRAME, 255].repeat(SIZE.element_product() as usize));
        let feed = CameraFeed::pixels(frame.expect("as many bytes as the size says")).with_pace(FeedPace::Lockstep);
        world.spawn((ArCamera::new(intrinsics), feed, target, eye));
        let anchor = MarkerAnchor::new(0, 0.1);
        let board = MarkerBoard::box_sides(&anchor, Vec3::new(0.14, 0.08, 0.14), 0.05);
        world.spawn((anchor, board, Transform::from_xyz(-0.05, 0.08, 0.05)));
        world.spawn((LightProbeSphere { radius: 0.05, ..default() }, Transform::from_translation(BALL)));
        world.spawn(RealLight {
            id: 3,
            direction: Vec3::new(-0.4, 0.8, -0.3).normalize(),
            position: None,
            color: LinearRgba::rgb(1.0, 0.6, 0.2),
            irradiance: 2.0,
            angular_radius: 0.05,
            fraction: 0.42,
        });
        world.spawn(ShadowDomeLight::default());
        let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::new(0.06, 0.1, 0.06));
        world.spawn((PhantomObject::default(), Mesh3d(mesh), Transform::from_xyz(0.3, 0.05, -0.05)));
        headless::settle(&mut app).expect("it is drawn");
        Some(Self { app, picture, intrinsics, camera_from_world: eye.to_matrix().inverse() })
    }

    /// Draws with these gizmos, or none, and returns the picture.
    fn draw(&mut self, gizmos: Option<MirrorballGizmos>) -> image::RgbaImage {
        let mut store = self.app.world_mut().resource_mut::<GizmoConfigStore>();
        let (config, group) = store.config_mut::<MirrorballGizmos>();
        config.enabled = gizmos.is_some();
        *group = gizmos.unwrap_or_default();
        headless::settle(&mut self.app).expect("it is drawn");
        let pixels = headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back");
        image::RgbaImage::from_raw(SIZE.x, SIZE.y, pixels).expect("four bytes a pixel")
    }

    fn pixel_of(&self, world: Vec3) -> Vec2 {
        self.intrinsics.project(self.camera_from_world.transform_point3(world)).expect("in front of the camera")
    }
}

const NOTHING: MirrorballGizmos =
    MirrorballGizmos { markers: false, balls: false, lights: false, dome: false, phantoms: false };

fn is_changed(before: &image::Rgba<u8>, now: &image::Rgba<u8>) -> bool {
    before.0.iter().zip(now.0).any(|(before, now)| before.abs_diff(now) > MIN_CHANGE)
}

/// Number of pixels that differ between two pictures.
fn changed(before: &image::RgbaImage, now: &image::RgbaImage) -> usize {
    before.pixels().zip(now.pixels()).filter(|(before, now)| is_changed(before, now)).count()
}

/// Distance in pixels from a place to the nearest pixel that differs between two pictures and is of a color.
fn distance_to_line(
    off: &image::RgbaImage,
    on: &image::RgbaImage,
    place: Vec2,
    is_color: impl Fn([u8; 4]) -> bool,
) -> f32 {
    let lines = on.enumerate_pixels().zip(off.pixels());
    let of_color = lines.filter(|((.., now), before)| is_changed(before, now) && is_color(now.0));
    of_color.map(|((x, y, _), _)| place.distance(Vec2::new(x as f32, y as f32) + 0.5)).fold(f32::INFINITY, f32::min)
}

#[test]
fn gizmos_are_where_the_things_are_and_off_by_default() {
    let Some(mut desk) = Desk::new() else { return };
    let first = headless::read_texture(&mut desk.app, &desk.picture).expect("the picture comes back");
    let first = image::RgbaImage::from_raw(SIZE.x, SIZE.y, first).expect("four bytes a pixel");
    let off = desk.draw(None);
    assert_eq!(changed(&first, &off), 0, "off by default");
    let nothing = desk.draw(Some(NOTHING));
    assert_eq!(changed(&off, &nothing), 0, "nothing is chosen");
    let on = desk.draw(Some(MirrorballGizmos::default()));
    let looked_at = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("gizmos.png");
    on.save(looked_at).expect("a writable folder");
    let off_again = desk.draw(None);
    assert_eq!(changed(&off, &off_again), 0, "off again");

    // Each kind alone, at points that it has to pass through.
    let gray = |c: [u8; 4]| c[0] == c[1] && c[1] == c[2];
    let markers = desk.draw(Some(MirrorballGizmos { markers: true, ..NOTHING }));
    for (x, z) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let corner = Vec3::new(-0.05 + 0.05 * x, 0.08, 0.05 + 0.05 * z);
        let off_by = distance_to_line(&off, &markers, desk.pixel_of(corner), gray);
        assert!(off_by < LINE_PIXELS, "corner {corner} is {off_by} pixels away");
    }
    // the front side of the box, upright, 5 cm wide
    for corner in [Vec3::new(-0.075, 0.065, 0.12), Vec3::new(-0.025, 0.015, 0.12)] {
        assert!(distance_to_line(&off, &markers, desk.pixel_of(corner), gray) < LINE_PIXELS, "on the box at {corner}");
    }
    let up = desk.pixel_of(Vec3::new(-0.05, 0.08 + 0.047, 0.05));
    assert!(distance_to_line(&off, &markers, up, |c| c[1] > 100 && c[0] < 60) < LINE_PIXELS, "y is green");

    let balls = desk.draw(Some(MirrorballGizmos { balls: true, ..NOTHING }));
    // The lowest and highest points of the limb: where lines of sight in the plane of the view's axis touch the ball.
    let eye = desk.camera_from_world.inverse().transform_point3(Vec3::ZERO);
    let (towards_eye, distance) = (eye - BALL).normalize_and_length();
    let across = towards_eye.any_orthonormal_vector();
    for side in [-1.0, 1.0] {
        let sine: f32 = 0.05 / distance;
        let limb = BALL + 0.05 * (sine * towards_eye + side * (1.0 - sine * sine).sqrt() * across);
        assert!(distance_to_line(&off, &balls, desk.pixel_of(limb), |_| true) < LINE_PIXELS, "the limb at {limb}");
    }
    assert!(distance_to_line(&off, &balls, desk.pixel_of(BALL), |_| true) > 10.0, "an outline, no disk");

    let phantoms = desk.draw(Some(MirrorballGizmos { phantoms: true, ..NOTHING }));
    let magenta = |c: [u8; 4]| c[0] > 150 && c[2] > 150 && c[1] < 90;
    for corner in [Vec3::new(0.27, 0.1, -0.02), Vec3::new(0.33, 0.0, -0.02), Vec3::new(0.33, 0.1, -0.08)] {
        assert!(distance_to_line(&off, &phantoms, desk.pixel_of(corner), magenta) < LINE_PIXELS, "corner {corner}");
    }

    let lights = desk.draw(Some(MirrorballGizmos { lights: true, ..NOTHING }));
    let tip = BALL + Vec3::new(-0.4, 0.8, -0.3).normalize() * 0.06;
    let orange = |c: [u8; 4]| c[0] > 180 && c[2] < 160;
    assert!(distance_to_line(&off, &lights, desk.pixel_of(tip), orange) < LINE_PIXELS, "the arrow's tip");
    let dome = desk.draw(Some(MirrorballGizmos { dome: true, ..NOTHING }));
    let lines = |picture: &image::RgbaImage| changed(&off, picture);
    assert!(lines(&dome) > 200, "{} pixels of the dome", lines(&dome));
    for (name, one) in [("markers", &markers), ("balls", &balls), ("lights", &lights), ("phantoms", &phantoms)] {
        assert!(lines(one) > 40 && lines(one) < lines(&on), "{name}: {} of {} pixels", lines(one), lines(&on));
    }
}
