//! Bounced light against path tracing.

mod walls;

use crate::{gpu, sky_cube::sky_cube};
use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight},
    prelude::*,
};
use bevy_mirrorball::{
    camera::srgb_to_linear,
    headless,
    materials::MaterialsPlugin,
    phantom::PhantomPlugin,
    prelude::*,
    shadows::{ShadowsPlugin, VisibilitySamples},
};
use std::f32::consts::PI;
use walls::{Wall, irradiance, room};

const SIZE: UVec2 = UVec2::splat(96);
/// Radiance of the sky, all around.
const SKY: f32 = 0.5;
/// Height of the camera above the floor, which it looks down on, and half the width that it sees there.
const HEIGHT: f32 = 1.5;
const HALF_WIDTH: f32 = 0.6;

struct Room {
    app: App,
    picture: Handle<Image>,
}

impl Room {
    fn new(walls: &[Wall], dome: ShadowDomeLight) -> Option<Self> {
        let mut app = gpu::app(|app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
        })?;
        let map = app.world_mut().resource_mut::<Assets<Image>>().add(sky_cube(32, |_| Vec3::splat(SKY)));
        let (picture, target) = headless::add_target(&mut app, SIZE);
        let world = app.world_mut();
        world.spawn(dome);
        world.spawn((
            Camera3d::default(),
            Projection::from(PerspectiveProjection { fov: 2.0 * (HALF_WIDTH / HEIGHT).atan(), ..default() }),
            Transform::from_xyz(0.0, HEIGHT, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z),
            EnvironmentMapLight {
                diffuse_map: map.clone(),
                specular_map: map,
                intensity: 1.0 / Exposure::default().exposure(),
                ..default()
            },
            (target, Msaa::Off, Tonemapping::None, DebandDither::Disabled),
        ));
        world.insert_resource(GlobalAmbientLight::NONE);
        for wall in walls {
            let mesh = world.resource_mut::<Assets<Mesh>>().add(Cuboid::from_size(2.0 * wall.half));
            let material = StandardMaterial {
                base_color: LinearRgba::from_vec3(wall.albedo).into(),
                perceptual_roughness: 1.0,
                reflectance: 0.0,
                ..default()
            };
            let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
            world.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(wall.center)));
        }
        Some(Self { app, picture })
    }

    /// Light on the floor in a picture, in linear camera units.
    fn shoot(&mut self) -> impl Fn(Vec3) -> Vec3 {
        (0..12).for_each(|_| self.app.update());
        let pixels = headless::read_texture(&mut self.app, &self.picture).expect("the picture comes back");
        move |place: Vec3| {
            let pixel = (0.5 + 0.5 * place.xz() / HALF_WIDTH) * SIZE.as_vec2();
            let at = 4 * (pixel.y as usize * SIZE.x as usize + pixel.x as usize);
            Vec3::from_array([0, 1, 2].map(|channel| srgb_to_linear(pixels[at + channel])))
        }
    }
}

/// A grid of places on the floor, away from the walls by more than a pixel.
fn places() -> impl Iterator<Item = Vec3> {
    (0..5).flat_map(|y| (0..5).map(move |x| Vec3::new(x as f32 - 2.0, 0.0, y as f32 - 2.0) * 0.22))
}

fn dome(samples: VisibilitySamples) -> ShadowDomeLight {
    ShadowDomeLight { directions: 256, samples, ..default() }
}

#[test]
fn a_white_room_has_the_light_of_a_path_tracer() {
    let albedo = Vec3::splat(0.8);
    for (height, samples) in
        [(0.5, VisibilitySamples::Interleaved), (0.5, VisibilitySamples::Fragment), (1.0, VisibilitySamples::Full)]
    {
        let walls = room(height, albedo);
        let Some(mut scene) = Room::new(&walls, dome(samples)) else { return };
        let picture = scene.shoot();
        let light = |place: Vec3| albedo * irradiance(&walls, SKY, place, Vec3::Y, 2) / PI;
        let (mut drawn, mut expected, mut worst) = (0.0, 0.0, 0.0f32);
        for place in places() {
            let (found, truth) = (picture(place).y, light(place).y);
            drawn += found;
            expected += truth;
            worst = worst.max((found / truth - 1.0).abs());
        }
        println!("{height} m, {samples:?}: energy {:.4} of the truth, worst place {worst:.3}", drawn / expected);
        assert!((drawn / expected - 1.0).abs() < 0.03, "energy {}", drawn / expected);
        assert!(worst < 0.2, "{worst}");
    }
}

#[test]
fn a_red_wall_colors_the_floor_beside_it() {
    let mut walls = room(0.0, Vec3::splat(0.8))[..1].to_vec();
    let wall = Wall {
        center: Vec3::new(0.0, 0.15, 0.1),
        half: Vec3::new(0.3, 0.15, 0.02),
        albedo: Vec3::new(0.8, 0.05, 0.05),
    };
    walls.push(wall);
    let Some(mut scene) = Room::new(&walls, dome(VisibilitySamples::Interleaved)) else { return };
    let picture = scene.shoot();
    let (mut drawn, mut expected) = (0.0, 0.0);
    for place in places().filter(|place| place.z < 0.0 && place.z > -0.4 && place.x.abs() < 0.4) {
        let (found, truth) = (picture(place), 0.8 * irradiance(&walls, SKY, place, Vec3::Y, 2) / PI);
        drawn += found.x - found.y;
        expected += truth.x - truth.y;
    }
    println!("color bleeding {:.3} of the truth", drawn / expected);
    assert!((drawn / expected - 1.0).abs() < 0.1, "{}", drawn / expected);

    let mut dark =
        Room::new(&walls, ShadowDomeLight { surfels: 0, ..dome(VisibilitySamples::Interleaved) }).expect("as before");
    let picture = dark.shoot();
    assert!(
        places().all(|place| (picture(place).x - picture(place).y).abs() < 0.01),
        "no bounced light without surfels"
    );
}
