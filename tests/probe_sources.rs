//! What lights a scene when the ball is covered, cut off or missing: earlier views, other cameras, a fitted sky.

mod cubes;
mod gpu;

use bevy::{light::EnvironmentMapLight, prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    environment_map::CubePixels,
    environment_map::EnvironmentCube,
    offscreen,
    phantom::PhantomPlugin,
    prelude::*,
    probe::{
        BallView, ClipRecovery, EnvironmentFallback, EnvironmentOrigin, FisheyeProjection, LightProbeCamera,
        ProbeCameraState, ProbeLens, ProbeMeasurement, ProbePlugin,
    },
    unwrap::UnwrapPlugin,
};
use std::time::Duration;

const SIZE: UVec2 = UVec2::new(200, 150);
const BALL: Vec3 = Vec3::new(0.0, 0.05, 0.0);
const RADIUS: f32 = 0.05;
/// A pixel of the ball spans 2.5° and more, and 8-bit steps are 1 % in the darker parts.
const BALL_TOLERANCE: f32 = 0.05;
/// The pictures of lenses are finer than the cube, but for a texel at their rims.
const LENS_TOLERANCE: f32 = 0.03;

fn intrinsics() -> Intrinsics {
    Intrinsics { focal: Vec2::splat(250.0), center: SIZE.as_vec2() * 0.5, size: SIZE }
}

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
    picture(SIZE, |pixel| match ball.mirrored_direction(intrinsics().ray(pixel)) {
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
    app.world_mut().spawn((ArCamera::new(intrinsics()), pose, camera, feed)).id()
}

fn add_ball(app: &mut App) -> Entity {
    let sphere = LightProbeSphere { radius: RADIUS, reflectance: 0.9, ..default() };
    let recovery = ClipRecovery { is_enabled: false, ..default() };
    app.world_mut().spawn((sphere, recovery, Transform::from_translation(BALL))).id()
}

/// Shaders arrive in their own time, bounds of meshes and cubes a frame later.
fn settle(app: &mut App) {
    offscreen::settle(app).expect("all shaders compile");
}

fn read(app: &mut App) -> CubePixels {
    let world = app.world_mut();
    let cube = world.query::<&EnvironmentCube>().iter(world).next().expect("there is a cube").0.clone();
    cubes::read(app, &cube)
}

/// Mean relative error over the directions that are asked about, and the darkest channel.
fn judge(cube: &CubePixels, is_asked: impl Fn(Vec3) -> bool) -> (f32, f32) {
    let (mut sum, mut count, mut darkest) = (0.0, 0.0, f32::MAX);
    for dir in cubes::sphere(8000).filter(|dir| is_asked(*dir)) {
        let (seen, wanted) = (cube.sample(dir), smooth(dir));
        sum += ((seen - wanted) / wanted).abs().element_sum() / 3.0;
        count += 1.0;
        darkest = darkest.min(seen.min_element());
    }
    assert!(count > 100.0);
    (sum / count, darkest)
}

#[test]
fn a_covered_ball_keeps_what_it_showed_before() {
    let Some(mut app) = app() else { return };
    // What was seen is believed for some seconds: not those of a busy machine.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(20)));
    let pose = looking_at(BALL);
    let camera = add_camera(&mut app, pose, photograph(pose, |_| false));
    let probe = add_ball(&mut app);
    settle(&mut app);
    let free = app.world().get::<ProbeMeasurement>(probe).expect("a required component").seen_fraction;

    // A plate halfway to the ball, over the right half of it.
    let eye = pose.translation;
    let plate = pose.transform_point(Vec3::new(0.06, 0.0, -0.5 * eye.distance(BALL)));
    let place = Transform::from_translation(plate).with_rotation(pose.rotation);
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(Cuboid::new(0.12, 0.16, 0.002));
    app.world_mut().spawn((Mesh3d(mesh), PhantomObject::default(), place));
    let covered = photograph(pose, |pixel| pixel.x > intrinsics().center.x);
    app.world_mut().entity_mut(camera).insert(CameraFeed::pixels(covered).with_pace(FeedPace::Lockstep));
    settle(&mut app);
    let measurement = app.world().get::<ProbeMeasurement>(probe).expect("a required component").clone();
    let cube = read(&mut app);
    let axis = (eye - BALL).normalize();
    let right = pose.right();
    let is_behind_plate = |dir: Vec3| dir.dot(axis) > -0.6 && dir.dot(*right) > 0.1;
    let (error, darkest) = judge(&cube, is_behind_plate);
    println!(
        "seen {free:.2} → {:.2} of all directions; behind the plate off by {:.1} %, darkest {darkest:.2}",
        measurement.seen_fraction,
        100.0 * error
    );
    assert!(measurement.is_in_view && free > 0.8);
    assert!((0.3..0.65).contains(&(measurement.seen_fraction / free)));
    assert!(error < BALL_TOLERANCE && darkest > 0.1);
    let (everywhere, _) = judge(&cube, |dir| dir.dot(axis) > -0.6);
    assert!(everywhere < BALL_TOLERANCE, "{everywhere}");
}

#[test]
fn a_ball_cut_off_by_the_border_is_used_as_far_as_it_goes() {
    let Some(mut app) = app() else { return };
    // The ball leaves the picture to the left by half its width.
    let pose = looking_at(BALL);
    let aside = pose.rotation * Quat::from_rotation_y(-(SIZE.x as f32 * 0.5 / 250.0).atan());
    let pose = Transform { rotation: aside, ..pose };
    add_camera(&mut app, pose, photograph(pose, |_| false));
    let probe = add_ball(&mut app);
    settle(&mut app);
    let measurement = app.world().get::<ProbeMeasurement>(probe).expect("a required component").clone();
    let cube = read(&mut app);
    let axis = (pose.translation - BALL).normalize();
    let (seen, darkest) = judge(&cube, |dir| dir.dot(axis) > -0.5 && dir.dot(*looking_at(BALL).right()) > 0.25);
    let (_, darkest_of_all) = judge(&cube, |_| true);
    println!(
        "{:.2} seen, off by {:.1} %, darkest {darkest:.2} there, {darkest_of_all:.2} anywhere",
        measurement.seen_fraction,
        100.0 * seen
    );
    assert!(measurement.is_in_view && (0.2..0.7).contains(&measurement.seen_fraction));
    assert!(seen < BALL_TOLERANCE && darkest_of_all > 0.05);
}

#[test]
fn each_lens_gives_the_light_that_it_sees() {
    use FisheyeProjection::{Equidistant, Equisolid, Orthographic, Stereographic};
    let fisheye = |projection, fov_degrees| ProbeLens::Fisheye { projection, fov_degrees, circle: None };
    let lenses = [
        (fisheye(Equidistant, 180.0), -0.05),
        (fisheye(Equisolid, 200.0), 0.1),
        (fisheye(Stereographic, 160.0), -0.25),
        (fisheye(Orthographic, 180.0), -0.2),
        (ProbeLens::Equirect, 2.0),
        (ProbeLens::SphereMap { wrap: 1.0, circle: None }, 0.8),
    ];
    for (lens, seen_below) in lenses {
        let Some(mut app) = app() else { return };
        let size = if lens == ProbeLens::Equirect { UVec2::new(320, 160) } else { UVec2::splat(220) };
        let pose = Transform::default().looking_to(Vec3::new(0.2, 1.0, 0.1).normalize(), Vec3::NEG_Z);
        let frame =
            picture(size, |pixel| lens.direction(pixel, size).map_or(Vec3::ZERO, |dir| smooth(pose.rotation * dir)));
        let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
        let camera = app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed, pose)).id();
        settle(&mut app);
        assert_eq!(app.world().get::<ProbeCameraState>(camera), Some(&ProbeCameraState::Measuring));
        let cube = read(&mut app);
        let forward = *pose.forward();
        // A sphere map looks at the ball: what it shows best is behind the camera.
        let is_ball = matches!(lens, ProbeLens::SphereMap { .. });
        let (error, darkest) =
            judge(&cube, |dir| if is_ball { -dir.dot(forward) > -seen_below } else { dir.dot(forward) > -seen_below });
        println!("{lens:?}: off by {:.2} %, darkest {darkest:.2}", 100.0 * error);
        assert!(error < LENS_TOLERANCE && darkest > 0.05);
    }
}

#[test]
fn a_fisheye_fills_what_the_ball_does_not_show() {
    let Some(mut app) = app() else { return };
    let pose = looking_at(BALL);
    add_camera(&mut app, pose, photograph(pose, |_| false));
    add_ball(&mut app);
    let lens = ProbeLens::default();
    let size = UVec2::splat(200);
    // Looks where the ball hides most.
    let forward = pose.forward();
    let look = Transform::default().looking_to(*forward, Vec3::Y);
    let frame =
        picture(size, |pixel| lens.direction(pixel, size).map_or(Vec3::ZERO, |dir| smooth(look.rotation * dir)));
    settle(&mut app);
    let hidden = |dir: Vec3| dir.dot(*forward) > 0.8;
    let (before, _) = judge(&read(&mut app), hidden);
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed, look));
    settle(&mut app);
    let cube = read(&mut app);
    let ((after, _), (all, _)) = (judge(&cube, hidden), judge(&cube, |_| true));
    println!(
        "behind the ball off by {:.1} % → {:.1} % with a fisheye; everywhere {:.1} %",
        100.0 * before,
        100.0 * after,
        100.0 * all
    );
    assert!(after < LENS_TOLERANCE && after < 0.5 * before && all < BALL_TOLERANCE);
}

#[test]
fn a_lens_that_cannot_be_is_refused_with_a_reason() {
    let Some(mut app) = app() else { return };
    let lens = ProbeLens::Fisheye { projection: FisheyeProjection::Orthographic, fov_degrees: 220.0, circle: None };
    let feed = CameraFeed::pixels(picture(UVec2::splat(16), |_| Vec3::ONE)).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((LightProbeCamera { lens, ..default() }, feed)).id();
    app.update();
    app.update();
    let state = app.world().get::<ProbeCameraState>(camera);
    assert!(matches!(state, Some(ProbeCameraState::Refused(reason)) if reason.contains("fov_degrees")), "{state:?}");
}

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
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("fallback.hdr");
    let texels = vec![Vec3::new(0.7, 0.2, 3.0); 32 * 16];
    bevy_mirrorball::environment_map::EquirectPixels { size: UVec2::new(32, 16), texels }.save(&path).expect("written");
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
