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
    camera::srgb_to_linear, headless, materials::MaterialsPlugin, phantom::PhantomPlugin, prelude::*,
    shadows::ShadowsPlugin,
};

/// Things on a virtual desk, seen from above.
pub(super) struct VirtualScene<'a> {
    pub(super) things: &'a [Thing],
    /// Everything is this many times as large.
    pub(super) scale: f32,
    /// Position of the camera before scaling.
    pub(super) camera: Vec3,
    pub(super) map: Image,
    pub(super) map_rotation: Quat,
    pub(super) dome: ShadowDomeLight,
}

impl VirtualScene<'_> {
    /// Returns the app, its picture, and what is in the picture while the desk is empty.
    pub(super) fn furnish(self) -> Option<(App, Handle<Image>, Shot)> {
        let mut app = gpu::app(|app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
        })?;
        let scale = self.scale;
        let map = app.world_mut().resource_mut::<Assets<Image>>().add(self.map);
        let (picture, target) = headless::add_target(&mut app, SIZE);
        let world = app.world_mut();
        world.spawn(ShadowDomeLight { surfels: 0, ..self.dome });
        let fov = 2.0 * (0.5 * SIZE.y as f32 / INTRINSICS.focal.y).atan();
        let on_desk = Vec3::new(self.camera.x, 0.0, self.camera.z);
        world.spawn((
            Camera3d::default(),
            Projection::from(PerspectiveProjection { fov, near: 0.01 * scale, ..default() }),
            Transform::from_translation(scale * self.camera).looking_at(scale * on_desk, Vec3::NEG_Z),
            EnvironmentMapLight {
                diffuse_map: map.clone(),
                specular_map: map,
                intensity: 1.0 / Exposure::default().exposure(),
                rotation: self.map_rotation,
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
        let open = shoot(&mut app, &picture);
        for thing in self.things {
            add(app.world_mut(), thing.mesh(), thing.center);
        }
        Some((app, picture, open))
    }
}

pub(super) fn shoot(app: &mut App, picture: &Handle<Image>) -> Shot {
    (0..12).for_each(|_| app.update());
    Shot(headless::read_texture(app, picture).expect("the picture comes back"))
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
        let scene = VirtualScene {
            things: &things(),
            scale,
            camera: Vec3::new(0.0, HEIGHT, 0.0),
            map: sky_cube(64, light),
            map_rotation: rotation,
            dome: ShadowDomeLight { directions: 256, ..default() },
        };
        let Some((mut app, picture, open)) = scene.furnish() else { return };
        let furnished = shoot(&mut app, &picture);
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
