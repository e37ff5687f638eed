//! The dome's shadows against rays: what share of the sky's light reaches a place on a desk between boxes and balls.

mod desk;
mod gpu;
mod shared_data;

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight, NotShadowCaster},
    prelude::*,
};
use bevy_mirrorball::{
    camera::srgb_to_linear,
    environment_map::EnvironmentCube,
    environment_map::{EquirectPixels, equirect_direction},
    lighting::RealLight,
    materials::MaterialsPlugin,
    offscreen,
    phantom::PhantomPlugin,
    prelude::*,
    shadows::{DomeCoverage, DomeLights, DomeState, LightsFile, ShadowFilter, ShadowsPlugin, VisibilitySamples},
};
use desk::{Desk, HEIGHT, SIZE, Shot, intrinsics};

/// Directions of the reference.
const RAYS: u32 = 4096;
/// Edge of the cubes that real environments are put into.
const CUBE_EDGE: u32 = 128;

const REAL_SKIES: [&str; 6] = [
    "studio_small_03_1k.hdr",
    "lebombo_1k.hdr",
    "venice_sunset_1k.hdr",
    "empty_warehouse_01_1k.hdr",
    "potsdamer_platz_1k.hdr",
    "night.exr",
];

#[derive(Clone, Copy)]
enum Shape {
    /// Half of its extents.
    Block(Vec3),
    Ball(f32),
}

#[derive(Clone, Copy)]
struct Thing {
    shape: Shape,
    center: Vec3,
    is_real: bool,
}

impl Thing {
    fn mesh(&self) -> Mesh {
        match self.shape {
            Shape::Block(half) => Cuboid::from_size(2.0 * half).into(),
            Shape::Ball(radius) => Sphere::new(radius).mesh().ico(16).expect("few enough"),
        }
    }

    /// Whether a ray meets the thing.
    fn blocks(&self, from: Vec3, dir: Vec3) -> bool {
        let from = from - self.center;
        match self.shape {
            Shape::Ball(radius) => {
                let along = from.dot(dir);
                along < 0.0 && from.length_squared() - along * along < radius * radius
            }
            Shape::Block(half) => {
                let (a, b) = ((-half - from) / dir, (half - from) / dir);
                let (near, far) = (a.min(b).max_element(), a.max(b).min_element());
                near < far && far > 0.0
            }
        }
    }
}

/// A few things of 3 to 16 cm, one of them real, one that does not touch the desk.
fn things() -> Vec<Thing> {
    let thing = |shape, x, y, z, is_real| Thing { shape, center: Vec3::new(x, y, z), is_real };
    vec![
        thing(Shape::Block(Vec3::new(0.03, 0.05, 0.04)), -0.12, 0.05, 0.02, false),
        thing(Shape::Ball(0.03), 0.05, 0.03, -0.08, false),
        thing(Shape::Ball(0.025), 0.03, 0.12, 0.10, false),
        thing(Shape::Block(Vec3::new(0.04, 0.08, 0.01)), 0.15, 0.08, 0.03, true),
    ]
}

/// Evenly spread directions above the horizon, each with the light that comes from there.
fn sky(light: impl Fn(Vec3) -> Vec3) -> Vec<(Vec3, Vec3)> {
    let direction = |i: u32| {
        let height = (i as f32 + 0.5) / RAYS as f32;
        let across = (1.0 - height * height).sqrt();
        // The golden ratio's share of a turn between successive directions.
        let (sin, cos) = (i as f32 * 0.618_034 * std::f32::consts::TAU).sin_cos();
        Vec3::new(across * cos, height, across * sin)
    };
    (0..RAYS).map(direction).map(|dir| (dir, light(dir))).collect()
}

/// Camera × this is what the desk looks like with the virtual things on it.
fn true_ratio(things: &[Thing], sky: &[(Vec3, Vec3)], place: Vec3) -> Vec3 {
    let (mut before, mut after) = (Vec3::ZERO, Vec3::ZERO);
    for (dir, light) in sky {
        let blocked = |is_real| things.iter().any(|thing| thing.is_real == is_real && thing.blocks(place, *dir));
        if !blocked(true) {
            before += *light * dir.y;
            after += if blocked(false) { Vec3::ZERO } else { *light * dir.y };
        }
    }
    after / before.max(Vec3::splat(1e-9))
}

/// Places on the desk that the camera sees through the middles of pixels and that lie no nearer than a pixel to a thing's edge.
fn places(things: &[Thing]) -> Vec<Vec3> {
    let camera = Vec3::new(0.0, HEIGHT, 0.0);
    let place = |x: f32, y: f32| {
        let on_desk = (Vec2::new(x, y) - intrinsics().center) / intrinsics().focal * HEIGHT;
        Vec3::new(on_desk.x, 0.0, on_desk.y)
    };
    let is_seen = |place: Vec3| !things.iter().any(|thing| thing.blocks(camera, (place - camera).normalize()));
    let pixels = (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
    pixels
        .filter(|pixel| {
            [-1.0, 0.0, 1.0]
                .iter()
                .all(|dx| [-1.0, 0.0, 1.0].iter().all(|dy| is_seen(place(pixel.x + dx, pixel.y + dy))))
        })
        .map(|pixel| place(pixel.x, pixel.y))
        .collect()
}

struct Errors {
    rms: f32,
    worst: f32,
    /// Over those places only where at least a twentieth of the light is missing.
    rms_in_shadow: f32,
}

fn compare(shot: &Shot, truth: &[(Vec3, Vec3)]) -> Errors {
    let (mut sum, mut worst, mut in_shadow, mut count_in_shadow) = (0.0, 0.0f32, 0.0, 0);
    for (place, expected) in truth {
        let error = shot.ratio(*place) - expected.y;
        sum += error * error;
        worst = worst.max(error.abs());
        if expected.y < 0.95 {
            in_shadow += error * error;
            count_in_shadow += 1;
        }
    }
    let rms = |sum: f32, count: usize| (sum / count.max(1) as f32).sqrt();
    Errors { rms: rms(sum, truth.len()), worst, rms_in_shadow: rms(in_shadow, count_in_shadow) }
}

fn furnished_desk() -> Option<Desk> {
    let mut desk = Desk::new()?;
    for thing in things() {
        if thing.is_real {
            desk.add(thing.mesh(), thing.center, PhantomObject { receives: false, ..default() });
        } else {
            desk.add_virtual(thing.mesh(), thing.center);
        }
    }
    Some(desk)
}

fn set_dome(desk: &mut Desk, dome: ShadowDomeLight) {
    desk.app.world_mut().entity_mut(desk.dome).insert(dome);
}

fn truth(things: &[Thing], sky: &[(Vec3, Vec3)]) -> Vec<(Vec3, Vec3)> {
    places(things).into_iter().map(|place| (place, true_ratio(things, sky, place))).collect()
}

#[test]
fn under_an_even_sky_shadows_are_those_of_rays() {
    let Some(mut desk) = furnished_desk() else { return };
    let truth = truth(&things(), &sky(|_| Vec3::ONE));
    let shaded = truth.iter().filter(|(_, ratio)| ratio.y < 0.95).count();
    println!("{} places, {shaded} of them in shadow", truth.len());
    assert!(shaded > 500, "there are shadows to compare");
    let bilinear = ShadowFilter::Bilinear;
    let soft = ShadowFilter::Pcss { angular_radius: 0.1 };
    for (directions, samples, filter, goal) in [
        (64, VisibilitySamples::Interleaved, bilinear, 0.02),
        (64, VisibilitySamples::Half, bilinear, 0.02),
        (64, VisibilitySamples::Full, bilinear, 0.02),
        (64, VisibilitySamples::Fragment, bilinear, 0.02),
        (64, VisibilitySamples::Full, soft, 0.01),
        (256, VisibilitySamples::Interleaved, bilinear, 0.01),
        (256, VisibilitySamples::Half, bilinear, 0.01),
        (256, VisibilitySamples::Full, bilinear, 0.01),
    ] {
        set_dome(&mut desk, ShadowDomeLight { directions, samples, filter, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!(
            "{directions} directions, {samples:?}, {filter:?}: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
            errors.rms, errors.rms_in_shadow, errors.worst
        );
        assert!(errors.rms <= goal);
    }
}

#[test]
fn under_real_skies_shadows_are_close_to_those_of_rays() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    for name in REAL_SKIES {
        let Some(file) = shared_data::find(&format!("hdr/{name}")) else { return };
        let picture = EquirectPixels::open(&file).expect("an environment");
        let cube = picture.to_cube(CUBE_EDGE, Quat::IDENTITY);
        let truth = truth(&things(), &sky(|dir| cube.sample(dir)));
        let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(cube.to_image());
        let probe = desk.app.world_mut().spawn(EnvironmentCube(image)).id();
        for directions in [64, 256] {
            set_dome(&mut desk, ShadowDomeLight { directions, ..default() });
            let errors = compare(&desk.shoot(), &truth);
            println!(
                "{name}, {directions} directions: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
                errors.rms, errors.rms_in_shadow, errors.worst
            );
            assert!(errors.rms <= 0.15);
        }
        desk.app.world_mut().despawn(probe);
    }
}

#[test]
fn a_dome_all_around_shadows_like_one_above() {
    let Some(mut desk) = furnished_desk() else { return };
    let truth = truth(&things(), &sky(|_| Vec3::ONE));
    set_dome(&mut desk, ShadowDomeLight { directions: 128, coverage: DomeCoverage::Sphere, ..default() });
    let errors = compare(&desk.shoot(), &truth);
    println!("128 directions all around: RMSE {:.4}, worst {:.3}", errors.rms, errors.worst);
    assert!(errors.rms <= 0.02);
}

/// A cube of one color in each direction.
fn cube(edge: u32, light: impl Fn(Vec3) -> Vec3) -> Image {
    let size = UVec2::new(4 * edge, 2 * edge);
    let pixels = (0..size.y).flat_map(|y| (0..size.x).map(move |x| Vec2::new(x as f32 + 0.5, y as f32 + 0.5)));
    let picture = EquirectPixels {
        size,
        texels: pixels.map(|pixel| light(equirect_direction(pixel / size.as_vec2()))).collect(),
    };
    picture.to_cube(edge, Quat::IDENTITY).to_image()
}

/// The things on a virtual desk under a camera with an environment map, everything this many times as large.
fn virtual_scene(scale: f32, map: Image, rotation: Quat) -> Option<(App, Handle<Image>, Shot)> {
    let mut app = gpu::app(|app| {
        app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
    })?;
    let map = app.world_mut().resource_mut::<Assets<Image>>().add(map);
    let (picture, target) = offscreen::add_target(&mut app, SIZE);
    let world = app.world_mut();
    world.spawn(ShadowDomeLight { directions: 256, ..default() });
    let fov = 2.0 * (0.5 * SIZE.y as f32 / intrinsics().focal.y).atan();
    world.spawn((
        Camera3d::default(),
        Projection::from(PerspectiveProjection { fov, near: 0.01 * scale, ..default() }),
        Transform::from_xyz(0.0, HEIGHT * scale, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
        EnvironmentMapLight {
            diffuse_map: map.clone(),
            specular_map: map,
            intensity: 1.0 / Exposure::default().exposure(),
            rotation,
            ..default()
        },
        (target, Msaa::Off, Tonemapping::None, DebandDither::Disabled),
    ));
    world.insert_resource(GlobalAmbientLight::NONE);
    let white = StandardMaterial { perceptual_roughness: 1.0, reflectance: 0.0, ..default() };
    let white = world.resource_mut::<Assets<StandardMaterial>>().add(white);
    let add = |world: &mut World, mesh: Mesh, center: Vec3| {
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let place = Transform::from_translation(scale * center).with_scale(Vec3::splat(scale));
        world.spawn((Mesh3d(mesh), MeshMaterial3d(white.clone()), place)).id()
    };
    let ground = add(world, Plane3d::default().mesh().size(2.0, 2.0).build(), Vec3::ZERO);
    world.entity_mut(ground).insert(NotShadowCaster);
    (0..12).for_each(|_| app.update());
    let open = Shot(offscreen::read_texture(&mut app, &picture).expect("the picture comes back"));
    for thing in things() {
        add(app.world_mut(), thing.mesh(), thing.center);
    }
    Some((app, picture, open))
}

#[test]
fn without_probe_and_phantoms_the_cameras_environment_map_casts_shadows_at_any_scale() {
    // Half of the sky is bright, and the map is turned from +X to -Z.
    let light = |dir: Vec3| Vec3::splat(if dir.x > 0.0 { 0.6 } else { 0.2 });
    let rotation = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let all_virtual: Vec<Thing> = things().into_iter().map(|thing| Thing { is_real: false, ..thing }).collect();
    let truth = truth(&all_virtual, &sky(|dir| light(rotation.inverse() * dir)));
    // Things of half a centimetre, a desk, and a hall with things of three metres.
    for scale in [0.1, 1.0, 20.0] {
        let Some((mut app, picture, open)) = virtual_scene(scale, cube(64, light), rotation) else { return };
        (0..12).for_each(|_| app.update());
        let furnished = Shot(offscreen::read_texture(&mut app, &picture).expect("the picture comes back"));
        let (mut sum, mut worst) = (0.0, 0.0f32);
        for (place, expected) in &truth {
            let at = open.at(*place) + 1;
            let error = srgb_to_linear(furnished.0[at]) / srgb_to_linear(open.0[at]) - expected.y;
            sum += error * error;
            worst = worst.max(error.abs());
        }
        let rms = (sum / truth.len() as f32).sqrt();
        println!("under a turned map, {scale} times as large: RMSE {rms:.4}, worst {worst:.3}");
        assert!(rms <= 0.02);
    }
}

/// Of the lamp's light to that of the sky around it, on the desk.
const LAMP_TO_SKY: f32 = 2.0;
const LAMP_RADIUS: f32 = 0.07;

/// Evenly spread directions within an angle around one.
fn cone(around: Vec3, radius: f32) -> impl Iterator<Item = Vec3> {
    const COUNT: u32 = 128;
    let (right, up) = around.any_orthonormal_pair();
    (0..COUNT).map(move |i| {
        let (sin, cos) = (i as f32 * 0.618_034 * std::f32::consts::TAU).sin_cos();
        let across = radius.tan() * ((i as f32 + 0.5) / COUNT as f32).sqrt();
        (around + across * (cos * right + sin * up)).normalize()
    })
}

/// A lamp among a dim sky, as a cube and as the light that is found in it.
fn lamp_and_sky(towards: Vec3) -> (Image, RealLight) {
    let solid_angle = std::f32::consts::TAU * (1.0 - LAMP_RADIUS.cos());
    let radiance = LAMP_TO_SKY * std::f32::consts::PI / (solid_angle * towards.y);
    let image = cube(CUBE_EDGE, |dir| {
        Vec3::splat(0.1 + if dir.angle_between(towards) < LAMP_RADIUS { 0.1 * radiance } else { 0.0 })
    });
    let light = RealLight {
        id: 1,
        direction: towards,
        position: None,
        color: LinearRgba::WHITE,
        irradiance: 0.1 * radiance * solid_angle,
        angular_radius: LAMP_RADIUS,
        fraction: 0.5,
    };
    (image, light)
}

#[test]
fn a_key_light_throws_its_shadow_where_rays_throw_it() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    let towards = Vec3::new(-0.1, 0.8, 0.4).normalize();
    let (image, light) = lamp_and_sky(towards);
    let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(image);
    desk.app.world_mut().spawn(EnvironmentCube(image));
    desk.app.world_mut().spawn(light);
    // Of all rays together the sky gives the desk 1, so to speak, and the lamp twice as much.
    let mut rays = sky(|_| Vec3::splat(2.0 / RAYS as f32));
    rays.extend(cone(towards, LAMP_RADIUS).map(|dir| (dir, Vec3::splat(LAMP_TO_SKY / (128.0 * towards.y)))));
    let truth = truth(&things(), &rays);
    let mut errors = |key_lights: u32| {
        set_dome(&mut desk, ShadowDomeLight { key_lights, samples: VisibilitySamples::Full, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!(
            "{key_lights} key lights: RMSE {:.4} (in shadow {:.4}), worst {:.3}",
            errors.rms, errors.rms_in_shadow, errors.worst
        );
        let state = desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
        assert_eq!(state.key_lights, key_lights.min(1));
        errors.rms
    };
    let (without, with) = (errors(0), errors(2));
    assert!(with <= 0.02 && with < 0.3 * without);
    // The sum of all light stays what it is: where nothing is in the way the picture is untouched.
    let shot = desk.shoot();
    let far = Vec3::new(-0.3, 0.0, -0.2);
    assert!((shot.ratio(far) - 1.0).abs() < 0.02, "{}", shot.ratio(far));
}

#[test]
fn a_near_key_light_throws_shadows_from_where_it_is() {
    let Some(mut desk) = furnished_desk() else { return };
    desk.forget_light();
    let ball = Vec3::new(0.0, 0.05, 0.0);
    let position = Vec3::new(0.35, 0.55, 0.2);
    let (towards, away) = (position - ball).normalize_and_length();
    let (image, light) = lamp_and_sky(towards);
    let image = desk.app.world_mut().resource_mut::<Assets<Image>>().add(image);
    // The cube's place is where the light was measured.
    desk.app.world_mut().spawn((EnvironmentCube(image), Transform::from_translation(ball)));
    desk.app.world_mut().spawn(RealLight { position: Some(position), ..light });
    let lamp_radius = away * LAMP_RADIUS.tan();
    let truth: Vec<_> = places(&things())
        .into_iter()
        .map(|place| {
            let mut rays = sky(|_| Vec3::splat(2.0 / RAYS as f32));
            let (dir, distance) = (position - place).normalize_and_length();
            let strength = LAMP_TO_SKY / (128.0 * towards.y) * (away / distance).powi(2);
            rays.extend(cone(dir, (lamp_radius / distance).atan()).map(|dir| (dir, Vec3::splat(strength))));
            (place, true_ratio(&things(), &rays, place))
        })
        .collect();
    let mut errors = |key_lights: u32| {
        set_dome(&mut desk, ShadowDomeLight { key_lights, samples: VisibilitySamples::Full, ..default() });
        let errors = compare(&desk.shoot(), &truth);
        println!("near lamp, {key_lights} key lights: RMSE {:.4}, worst {:.3}", errors.rms, errors.worst);
        errors.rms
    };
    let (without, with) = (errors(0), errors(2));
    assert!(with <= 0.02 && with < 0.3 * without);
}

#[test]
fn lights_of_a_file_throw_shadows_from_where_they_are() {
    let Some(mut desk) = furnished_desk() else { return };
    let spot = Vec3::new(-0.25, 0.5, -0.2);
    let text = format!(
        r#"(lights: [
            (id: "spot", kind: Spot, position: ({}, {}, {}), look_at: (0.0, 0.0, 0.0), field_of_view: 80.0, far: 2.0),
            (id: "window", kind: Directional, position: (1.0, 1.5, 0.0), look_at: (0.0, 0.0, 0.0)),
        ])"#,
        spot.x, spot.y, spot.z
    );
    let window = Vec3::new(1.0, 1.5, 0.0).normalize();
    let file = LightsFile::parse(&text).expect("valid");
    let file = desk.app.world_mut().resource_mut::<Assets<LightsFile>>().add(file);
    let samples = VisibilitySamples::Full;
    let dome = ShadowDomeLight { samples, coverage: DomeCoverage::Sphere, ..default() };
    desk.app.world_mut().entity_mut(desk.dome).insert((dome, DomeLights(file)));
    // Each has the half of the sphere that is nearer to it: under an even sky the same light.
    let truth: Vec<_> = places(&things())
        .into_iter()
        .map(|place| {
            let rays = [((spot - place).normalize(), Vec3::ONE), (window, Vec3::ONE)];
            (place, true_ratio(&things(), &rays, place))
        })
        .collect();
    let shaded = truth.iter().filter(|(_, ratio)| ratio.y < 0.9).count();
    assert!(shaded > 100, "{shaded}");
    let shot = desk.shoot();
    let state = desk.app.world().get::<DomeState>(desk.dome).expect("it is a dome");
    println!("{state:?}");
    // At the edges of hard shadows a pixel is here or there.
    let wrong = truth.iter().filter(|(place, expected)| (shot.ratio(*place) - expected.y).abs() > 0.05).count();
    println!("{wrong} of {} places are off", truth.len());
    assert!(wrong * 50 < truth.len());
}
