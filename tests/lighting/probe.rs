//! The environment measured in a ray-traced photograph of a mirrored ball, against the one it was traced in.

use crate::cubes;
use crate::gpu;
use crate::sphere::sphere;
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    environment_map::CubePixels,
    environment_map::EnvironmentCube,
    headless,
    prelude::*,
    probe::{BallView, ClipRecovery, ProbeMeasurement, ProbePlugin, UniformSky},
    tracking::{MarkerState, MarkerTracking},
    unwrap::UnwrapPlugin,
};

/// A step of 8-bit sRGB is 0.7 % of a middle gray; the ball's rim stretches a pixel over several degrees.
const MEAN_TOLERANCE: f32 = 0.02;
/// At the rim a pixel spans several degrees, over which the environment below changes by some percent.
const WORST_TOLERANCE: f32 = 0.06;
/// Per step of 0.7°: the filled gap of some 15° bridges differences of up to 0.5.
const LARGEST_STEP: f32 = 0.04;
/// Half floats, which a driver may round towards zero.
const UNIFORM_TOLERANCE: f32 = 1e-3;
/// The paper's median is a whole sRGB step (0.6 %), and the CPU's cube has half the resolution of the GPU's.
const PAPER_TOLERANCE: f32 = 0.02;

const SIZE: UVec2 = UVec2::new(220, 150);
pub(crate) const BALL: Vec3 = Vec3::new(0.0, 0.05, 0.0);
pub(crate) const RADIUS: f32 = 0.05;
const MARKER: Vec3 = Vec3::new(0.095, 0.0, 0.0);
const MARKER_SIZE: f32 = 0.05;
/// Margin of the range that pixels within a pixel and a half of the rim show, as the probe documents it.
const EDGE_MARGIN_PIXELS: f32 = 1.5;
pub(crate) const REFLECTANCE: f32 = 0.8;
const PAPER: f32 = 0.6;

pub(crate) const INTRINSICS: Intrinsics = Intrinsics::new(Vec2::new(265.0, 260.0), Vec2::new(112.0, 74.0), SIZE);

pub(crate) fn camera_pose() -> Transform {
    Transform::from_xyz(0.08, 0.22, 0.24).looking_at(Vec3::new(0.047, 0.035, 0.0), Vec3::new(0.1, 1.0, 0.0))
}

fn ball_view() -> BallView {
    BallView::new(camera_pose().to_matrix().inverse().transform_point3(BALL), RADIUS).expect("in front")
}

/// Another function on every channel, none symmetric, all within 0.1…0.9.
pub(crate) fn smooth(dir: Vec3) -> Vec3 {
    Vec3::new(0.5 + 0.38 * dir.x, 0.5 + 0.3 * (2.0 * dir.y + dir.z).sin(), 0.5 + 0.35 * dir.z * dir.x - 0.1 * dir.y)
}

/// A dim room with one lamp that a camera clips.
fn lamp_room(dir: Vec3) -> Vec3 {
    let lamp = dir.angle_between(Vec3::new(0.4, 0.8, 0.3)) < 0.15;
    if lamp { Vec3::new(12.0, 10.0, 8.0) } else { Vec3::new(0.15, 0.2, 0.25) }
}

fn linear_to_srgb8(value: f32) -> u8 {
    let encoded = if value <= 0.0031308 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded.clamp(0.0, 1.0) + 0.5) as u8
}

/// Ray-traced in double precision with 4 × 4 rays a pixel: the ball, a marker's sheet on the desk, the desk.
pub(crate) fn photograph(environment: fn(Vec3) -> Vec3) -> FramePixels {
    const RAYS: u32 = 4;
    let world_from_camera = camera_pose().to_matrix().as_dmat4();
    let eye = world_from_camera.w_axis.truncate();
    let radiance = |pixel: Vec2| {
        let ray = world_from_camera.transform_vector3(INTRINSICS.ray(pixel).as_dvec3()).normalize();
        let to_eye = eye - BALL.as_dvec3();
        let along = -ray.dot(to_eye);
        let discriminant = along * along - to_eye.length_squared() + f64::from(RADIUS).powi(2);
        if discriminant >= 0.0 {
            let normal = (to_eye + ray * (along - discriminant.sqrt())).normalize();
            return environment((ray - 2.0 * ray.dot(normal) * normal).as_vec3()) * REFLECTANCE;
        }
        let on_desk = (eye - ray * (eye.y / ray.y)).as_vec3() - MARKER;
        let from_middle = on_desk.abs().max_element() / MARKER_SIZE;
        match from_middle {
            d if d < 0.5 => Vec3::splat(0.02),
            d if d < 0.5 + 1.0 / 8.0 => Vec3::splat(PAPER),
            _ => Vec3::splat(0.3),
        }
    };
    let pixel = |i: u32| {
        let corner = Vec2::new((i % SIZE.x) as f32, (i / SIZE.x) as f32);
        let rays = (0..RAYS * RAYS).map(|k| (Vec2::new((k % RAYS) as f32, (k / RAYS) as f32) + 0.5) / RAYS as f32);
        let mean = rays.map(|offset| radiance(corner + offset).min(Vec3::ONE)).sum::<Vec3>() / (RAYS * RAYS) as f32;
        [linear_to_srgb8(mean.x), linear_to_srgb8(mean.y), linear_to_srgb8(mean.z), 255]
    };
    FramePixels::new(SIZE, (0..SIZE.x * SIZE.y).flat_map(pixel).collect()).expect("as many bytes as the size says")
}

/// An app that sees the ball; whatever else is there is up to `configure`.
fn probing_app(environment: fn(Vec3) -> Vec3) -> Option<(App, Entity)> {
    let mut app = gpu::app(|app| {
        app.add_plugins((CameraPlugin, ProbePlugin, UnwrapPlugin));
    })?;
    let feed = CameraFeed::pixels(photograph(environment)).with_pace(FeedPace::Lockstep);
    app.world_mut().spawn((ArCamera::new(INTRINSICS), camera_pose(), Camera { is_active: false, ..default() }, feed));
    let sphere = LightProbeSphere { radius: RADIUS, reflectance: REFLECTANCE, ..Default::default() };
    let probe = app.world_mut().spawn((sphere, Transform::from_translation(BALL))).id();
    headless::settle(&mut app).expect("all shaders compile");
    Some((app, probe))
}

fn measure(app: &mut App, probe: Entity) -> (CubePixels, ProbeMeasurement) {
    app.update();
    app.update();
    let cube = app.world().get::<EnvironmentCube>(probe).expect("every probe gets a cube").0.clone();
    let cube = cubes::read(app, &cube);
    (cube, app.world().get::<ProbeMeasurement>(probe).expect("a required component").clone())
}

#[test]
fn the_environment_is_found_again_in_its_directions() {
    let Some((mut app, probe)) = probing_app(smooth) else { return };
    let (cube, measurement) = measure(&mut app, probe);
    assert!(measurement.is_in_view && measurement.gain == Vec3::ONE);
    let world_from_camera = camera_pose().rotation;
    let axis = world_from_camera * -ball_view().center_camera.normalize();
    let edge_angle = ball_view().edge_angle(&INTRINSICS, EDGE_MARGIN_PIXELS);
    let (mut sum, mut count, mut worst) = (0.0, 0.0, (0.0, Vec3::ZERO));
    for dir in sphere(20_000).filter(|dir| axis.angle_between(*dir) < edge_angle) {
        let error = ((cube.sample(dir) - smooth(dir)) / smooth(dir)).abs();
        sum += error.element_sum() / 3.0;
        count += 1.0;
        if error.max_element() > worst.0 {
            worst = (error.max_element(), dir);
        }
    }
    let (mean, worst_angle) = (sum / count, axis.angle_between(worst.1).to_degrees());
    println!(
        "mean error {:.2} % over {:.0} % of the sphere; worst {:.1} % towards {}, {worst_angle:.0}° off the axis \
         of {:.0}°",
        1e2 * mean,
        count / 2e2,
        1e2 * worst.0,
        worst.1,
        edge_angle.to_degrees()
    );
    assert!(count > 17_000.0, "the ball shows nearly everything");
    assert!(mean <= MEAN_TOLERANCE && worst.0 <= WORST_TOLERANCE);

    // Great circles through the middle of what the ball hides.
    let (mut darkest, mut largest_step) = (f32::MAX, 0f32);
    for turn in 0..8 {
        let side = Quat::from_axis_angle(axis, turn as f32 * 0.39) * axis.any_orthonormal_vector();
        let seen = (0..=200).map(|i| cube.sample(Quat::from_axis_angle(side, 1.9 + 0.0125 * i as f32) * axis));
        let seen: Vec<Vec3> = seen.collect();
        darkest = seen.iter().fold(darkest, |least, l| least.min(l.min_element()));
        largest_step = seen.windows(2).fold(largest_step, |most, w| most.max((w[1] - w[0]).abs().max_element()));
    }
    println!("around the hidden cone: darkest {darkest:.3}, largest step {largest_step:.3} per 0.7°");
    assert!(darkest > 0.09 && largest_step <= LARGEST_STEP);
}

#[test]
fn a_uniform_sky_is_what_it_says_and_follows_changes_of_a_still_picture() {
    let Some((mut app, probe)) = probing_app(smooth) else { return };
    let colors = [Some(Vec3::new(0.3, 0.6, 5.0)), Some(Vec3::new(1.5, 0.1, 0.02)), None];
    for radiance in colors {
        app.world_mut().entity_mut(probe).insert(UniformSky { radiance });
        let (cube, _) = measure(&mut app, probe);
        let expected = radiance.unwrap_or(Vec3::ONE);
        let worst = cube.texels.iter().map(|l| ((*l - expected) / expected).abs().max_element()).fold(0.0, f32::max);
        println!("uniform sky {expected}: off by {worst:.1e}");
        assert!(worst <= UNIFORM_TOLERANCE);
    }
    app.world_mut().entity_mut(probe).remove::<UniformSky>();
    let (cube, _) = measure(&mut app, probe);
    assert!(cube.texels.iter().any(|l| l.x < 0.3), "the picture is back");
}

#[test]
fn a_ball_out_of_the_picture_keeps_its_last_environment() {
    let Some((mut app, probe)) = probing_app(smooth) else { return };
    let (before, _) = measure(&mut app, probe);
    let behind = camera_pose().translation - 0.5 * camera_pose().forward();
    for place in [Vec3::new(-0.3, 0.05, 0.0), behind] {
        app.world_mut().get_mut::<Transform>(probe).expect("a ball has a place").translation = place;
        let (after, measurement) = measure(&mut app, probe);
        assert!(!measurement.is_in_view, "{place}");
        assert!(after == before, "{place}: another environment");
    }
    app.world_mut().get_mut::<Transform>(probe).expect("a ball has a place").translation = BALL;
    assert!(measure(&mut app, probe).1.is_in_view);
}

#[test]
fn a_clipped_lamp_is_raised_until_it_explains_the_paper() {
    let Some((mut app, probe)) = probing_app(lamp_room) else { return };
    let camera_from_world = camera_pose().to_matrix().inverse();
    let (_, rotation, translation) =
        (camera_from_world * Mat4::from_translation(MARKER)).to_scale_rotation_translation();
    let tracking = MarkerTracking {
        state: MarkerState::Tracked,
        camera_from_marker: Some(Isometry3d::new(translation, rotation)),
        last_seen: Some(1),
        ..default()
    };
    app.world_mut().spawn((MarkerAnchor::new(0, MARKER_SIZE), tracking, Transform::from_translation(MARKER)));
    let irradiance = |cube: &CubePixels| {
        let count = 40_000;
        let sum: Vec3 = sphere(count).map(|dir| cube.sample(dir) * dir.y.max(0.0)).sum();
        sum * 4.0 / count as f32
    };
    let (cube, measurement) = measure(&mut app, probe);
    let paper = measurement.paper.expect("the marker is in view");
    let (recovered, wanted) = (irradiance(&cube), paper / ClipRecovery::default().paper_reflectance);
    app.world_mut().get_mut::<ClipRecovery>(probe).expect("a required component").is_enabled = false;
    let unrecovered = irradiance(&measure(&mut app, probe).0);
    println!(
        "paper {paper}, gain {}, irradiance/π {unrecovered} → {recovered}, wanted {wanted}; {:.1} % clipped",
        measurement.gain,
        1e2 * measurement.clipped_fraction
    );
    assert!((paper - PAPER).abs().max_element() < 0.01);
    assert!(measurement.gain.min_element() > 2.0 && measurement.clipped_fraction > 0.0);
    assert!(((recovered - wanted) / wanted).abs().max_element() <= PAPER_TOLERANCE);
    assert!((unrecovered / wanted).max_element() < 0.6, "without recovery the room would be too dark");
}
