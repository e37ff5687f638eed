//! Shadows in a scene without probe and phantoms, at any scale.

use super::rays::{Thing, sky, things, truth};
use crate::{
    desk::{HEIGHT, INTRINSICS, SIZE, Shot},
    gpu,
    sky_cube::sky_cube,
};
use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight, NotShadowCaster},
    prelude::*,
};
use bevy_mirrorball::{
    camera::srgb_to_linear, materials::MaterialsPlugin, offscreen, phantom::PhantomPlugin, prelude::*,
    shadows::ShadowsPlugin,
};

/// The things on a virtual desk under a camera with an environment map, everything this many times as large.
fn virtual_scene(scale: f32, map: Image, rotation: Quat) -> Option<(App, Handle<Image>, Shot)> {
    let mut app = gpu::app(|app| {
        app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
    })?;
    let map = app.world_mut().resource_mut::<Assets<Image>>().add(map);
    let (picture, target) = offscreen::add_target(&mut app, SIZE);
    let world = app.world_mut();
    world.spawn(ShadowDomeLight { directions: 256, ..default() });
    let fov = 2.0 * (0.5 * SIZE.y as f32 / INTRINSICS.focal.y).atan();
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
    // Things of half a centimeter, a desk, and a hall with things of three meters.
    for scale in [0.1, 1.0, 20.0] {
        let Some((mut app, picture, open)) = virtual_scene(scale, sky_cube(64, light), rotation) else { return };
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
