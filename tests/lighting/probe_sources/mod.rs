//! Sources of light when the ball is covered, cut off or missing: earlier frames, other cameras, a fitted sky.

mod ball;
mod fallback;
mod lenses;

use crate::{cubes, gpu, sphere::sphere};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    environment_map::{CubePixels, EnvironmentCube},
    headless,
    phantom::PhantomPlugin,
    prelude::*,
    probe::{BallView, ClipRecovery, ProbePlugin},
    unwrap::UnwrapPlugin,
};

const SIZE: UVec2 = UVec2::new(200, 150);
const BALL: Vec3 = Vec3::new(0.0, 0.05, 0.0);
const RADIUS: f32 = 0.05;
/// A pixel of the ball spans 2.5° and more, and 8-bit steps are 1 % in the darker parts.
const BALL_TOLERANCE: f32 = 0.05;
/// The pictures of lenses are finer than the cube, but for a texel at their rims.
const LENS_TOLERANCE: f32 = 0.03;

const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::splat(250.0), Vec2::new(100.0, 75.0), SIZE);

fn looking_at(target: Vec3) -> Transform {
    Transform::from_xyz(0.05, 0.25, 0.3).looking_at(target, Vec3::Y)
}

fn smooth(dir: Vec3) -> Vec3 {
    Vec3::new(0.5 + 0.3 * dir.x, 0.5 + 0.25 * (2.0 * dir.y + dir.z).sin(), 0.5 + 0.25 * dir.z * dir.x - 0.1 * dir.y)
}

/// A picture of the mean radiance within each pixel.
fn picture(size: UVec2, radiance: impl Fn(Vec2) -> Vec3) -> FramePixels {
    const RAYS: u32 = 3;
    let pixel = |i: u32| {
        let corner = UVec2::new(i % size.x, i / size.x).as_vec2();
        let rays = (0..RAYS * RAYS).map(|k| (UVec2::new(k % RAYS, k / RAYS).as_vec2() + 0.5) / RAYS as f32);
        let mean = rays.map(|offset| radiance(corner + offset)).sum::<Vec3>() / (RAYS * RAYS) as f32;
        Srgba::from(LinearRgba::from_vec3(mean)).to_u8_array()
    };
    FramePixels::new(size, (0..size.x * size.y).flat_map(pixel).collect()).expect("as many bytes as the size says")
}

/// The ball before something gray, with a black plate over pixels that are `covered`.
fn photograph(pose: Transform, covered: impl Fn(Vec2) -> bool) -> FramePixels {
    let world_from_camera = pose.to_matrix();
    let ball = BallView::new(world_from_camera.inverse().transform_point3(BALL), RADIUS).expect("in front");
    picture(SIZE, |pixel| match ball.mirrored_direction(INTRINSICS.ray(pixel)) {
        _ if covered(pixel) => Vec3::splat(0.001),
        Some(dir) => smooth(world_from_camera.transform_vector3(dir)) * 0.9,
        None => Vec3::splat(0.3),
    })
}

fn app() -> Option<App> {
    gpu::app(|app| {
        app.add_plugins((CameraPlugin, PhantomPlugin, ProbePlugin, UnwrapPlugin));
    })
}

fn add_camera(app: &mut App, pose: Transform, frame: FramePixels) -> Entity {
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    let camera = Camera { is_active: false, ..default() };
    app.world_mut().spawn((ArCamera::new(INTRINSICS), pose, camera, feed)).id()
}

fn add_ball(app: &mut App) -> Entity {
    let sphere = LightProbeSphere { radius: RADIUS, reflectance: 0.9, ..default() };
    let recovery = ClipRecovery { is_enabled: false, ..default() };
    app.world_mut().spawn((sphere, recovery, Transform::from_translation(BALL))).id()
}

/// Shaders arrive in their own time, bounds of meshes and cubes a frame later.
fn settle(app: &mut App) {
    headless::settle(app).expect("all shaders compile");
}

fn read(app: &mut App) -> CubePixels {
    let world = app.world_mut();
    let cube = world.query::<&EnvironmentCube>().iter(world).next().expect("there is a cube").0.clone();
    cubes::read(app, &cube)
}

/// Mean relative error over the directions that are asked about, and the darkest channel.
fn judge(cube: &CubePixels, is_asked: impl Fn(Vec3) -> bool) -> (f32, f32) {
    let (mut sum, mut count, mut darkest) = (0.0, 0.0, f32::MAX);
    for dir in sphere(8000).filter(|dir| is_asked(*dir)) {
        let (seen, wanted) = (cube.sample(dir), smooth(dir));
        sum += ((seen - wanted) / wanted).abs().element_sum() / 3.0;
        count += 1.0;
        darkest = darkest.min(seen.min_element());
    }
    assert!(count > 100.0);
    (sum / count, darkest)
}
