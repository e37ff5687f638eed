//! The scene that is measured, with the shadows of one method.

use crate::{
    options::{Case, Filter, Method, Options, REFRESHED},
    support::{Outcome, device_name, gray_sky},
};
use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    diagnostic::DiagnosticsStore,
    light::{EnvironmentMapLight, GlobalAmbientLight, NotShadowCaster},
    pbr::ScreenSpaceAmbientOcclusion,
    prelude::*,
    render::{RenderApp, diagnostic::RenderDiagnosticsPlugin, render_resource::PollType, renderer::RenderDevice},
};
use bevy_mirrorball::{
    headless,
    lighting::RealLight,
    materials::MaterialsPlugin,
    phantom::PhantomPlugin,
    prelude::*,
    shadows::{PlanarLight, PlanarLights, PlanarShadow, ShadowsPlugin},
};
use std::time::Instant;

/// Number of frames before the measurement.
const WARM_UP: usize = 5;
/// Number of things that have the triangles.
const CASTERS: u32 = 20;
/// Half the edge of the ground in meters.
const GROUND: f32 = 3.0;
/// Turn of whatever moves from frame to frame, in radians.
const TURN: f32 = 0.05;

/// Returns a sphere of about this many triangles.
fn ball(triangles: u32) -> Mesh {
    let sectors = (triangles as f32).sqrt().round().max(4.0) as u32;
    Sphere::new(0.15).mesh().uv(sectors, (triangles / (2 * sectors)).max(2) + 1)
}

/// The scene with the shadows of one method.
pub(crate) struct Stage {
    app: App,
    pub(crate) triangles: usize,
    turned: f32,
}

/// Casters, which turn in [`Case::Moving`].
#[derive(Component)]
struct Caster;

impl Stage {
    pub(crate) fn new(method: Method, triangles: u32, casters: u32, options: &Options) -> Outcome<Self> {
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
            if options.passes {
                app.add_plugins(RenderDiagnosticsPlugin);
            }
        })?;
        let (_, target) = headless::add_target(&mut app, options.size);
        let world = app.world_mut();
        world.insert_resource(GlobalAmbientLight::NONE);
        let map = gray_sky(&mut world.resource_mut::<Assets<Image>>());
        let camera = world
            .spawn((
                Camera3d::default(),
                camera_place(0.0),
                EnvironmentMapLight {
                    diffuse_map: map.clone(),
                    specular_map: map,
                    intensity: 1.0 / Exposure::default().exposure(),
                    ..default()
                },
                (target, Msaa::Off, Tonemapping::None, DebandDither::Disabled),
            ))
            .id();
        let white = world.resource_mut::<Assets<StandardMaterial>>().add(StandardMaterial::default());
        let ground =
            world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(2.0 * GROUND, 2.0 * GROUND));
        world.spawn((Mesh3d(ground), MeshMaterial3d(white.clone()), NotShadowCaster));
        let mesh = ball(triangles / CASTERS);
        let triangles = casters as usize * mesh.indices().map_or(0, |indices| indices.len() / 3);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        for i in 0..casters {
            // Twenty in rows of five, and the next twenty above them.
            let (within, layer) = (i % CASTERS, (i / CASTERS) as f32);
            let height = 0.15 + 0.1 * (within % 3) as f32 + 0.55 * layer;
            let place = Vec3::new(0.5 * (within % 5) as f32 - 1.0, height, 0.5 * (within / 5) as f32 - 0.75);
            let place = Transform::from_translation(place);
            world.spawn((Caster, Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()), place));
        }
        spawn_method(world, camera, method, options);
        let mut stage = Self { app, triangles, turned: 0.0 };
        (0..WARM_UP).for_each(|_| {
            stage.frame(Case::Moving);
        });
        Ok(stage)
    }

    /// Renders one frame and returns the time until the GPU has finished it, in milliseconds.
    pub(crate) fn frame(&mut self, case: Case) -> f64 {
        self.advance(case);
        let started = Instant::now();
        self.app.update();
        // A lost device does not respond; the next frame reports it.
        let _ = self.app.sub_app(RenderApp).world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
        started.elapsed().as_secs_f64() * 1e3
    }

    /// Moves what a case moves.
    fn advance(&mut self, case: Case) {
        self.turned += TURN;
        let (turn, all) = (Quat::from_rotation_y(TURN), Quat::from_rotation_y(self.turned));
        let world = self.app.world_mut();
        match case {
            Case::Static => (),
            Case::Lights => {
                for mut map in world.query::<&mut EnvironmentMapLight>().iter_mut(world) {
                    map.rotation = all;
                }
                for mut light in world.query::<&mut RealLight>().iter_mut(world) {
                    light.direction = (turn * light.direction).normalize();
                }
                for mut shadow in world.query::<&mut PlanarShadow>().iter_mut(world) {
                    shadow.lights = PlanarLights::Placed(vec![planar_light(all * towards(0))]);
                }
                for mut lamp in world.query_filtered::<&mut Transform, With<DirectionalLight>>().iter_mut(world) {
                    lamp.rotate(turn);
                }
            }
            Case::Moving => {
                for mut caster in world.query_filtered::<&mut Transform, With<Caster>>().iter_mut(world) {
                    caster.rotation = all;
                }
            }
            Case::Camera => {
                let turned = self.turned;
                for mut camera in world.query_filtered::<&mut Transform, With<Camera3d>>().iter_mut(world) {
                    *camera = camera_place(0.1 * turned.sin());
                }
            }
        }
    }

    /// Returns the milliseconds of each pass in the last frame that the GPU has reported, by label.
    pub(crate) fn passes(&self) -> Vec<(String, f64)> {
        let diagnostics = self.app.world().get_resource::<DiagnosticsStore>();
        let time_of = |diagnostic: &bevy::diagnostic::Diagnostic| {
            let label = diagnostic.path().as_str().strip_prefix("render/")?.strip_suffix("/elapsed_gpu")?;
            Some((label.to_owned(), diagnostic.value()?))
        };
        diagnostics.into_iter().flat_map(DiagnosticsStore::iter).filter_map(time_of).collect()
    }

    pub(crate) fn device(&self) -> String {
        device_name(&self.app)
    }
}

/// Place of the camera, some meters aside.
fn camera_place(aside: f32) -> Transform {
    Transform::from_xyz(aside, 2.2, 3.0).looking_at(Vec3::new(0.0, 0.2, 0.0), Vec3::Y)
}

/// Directions to lights all around.
fn towards(i: u32) -> Vec3 {
    Vec3::new((i as f32 * 2.4).cos(), 1.0 + 0.05 * i as f32, (i as f32 * 2.4).sin())
}

fn planar_light(towards: Vec3) -> PlanarLight {
    PlanarLight::distant(Dir3::new(towards).unwrap_or(Dir3::Y), 0.03)
}

/// Adds the lights or settings of a method to the scene.
fn spawn_method(world: &mut World, camera: Entity, method: Method, options: &Options) {
    match method {
        Method::None => (),
        Method::Dome(directions, samples, filter) => {
            let own = ShadowDomeLight::default();
            world.spawn(ShadowDomeLight {
                directions,
                filter: filter.map_or(own.filter, Filter::of_dome),
                samples: samples.of_dome(),
                key_lights: options.key_lights,
                refreshed_per_frame: REFRESHED,
                surfels: options.surfels,
                ..own
            });
            for id in 0..options.real_lights {
                world.spawn(RealLight {
                    id,
                    direction: towards(id).normalize(),
                    position: None,
                    color: LinearRgba::WHITE,
                    irradiance: 1.0,
                    angular_radius: 0.03,
                    fraction: 0.3,
                });
            }
        }
        Method::Planar(samples, ambient) => {
            let lights = PlanarLights::Placed(vec![planar_light(towards(0))]);
            world.spawn(PlanarShadow { half_size: Vec2::splat(GROUND), lights, samples, ambient, ..default() });
        }
        Method::Directional(count) => {
            for i in 0..count {
                let light = DirectionalLight { illuminance: 100.0, shadow_maps_enabled: true, ..default() };
                world.spawn((light, Transform::from_translation(towards(i)).looking_at(Vec3::ZERO, Vec3::Y)));
            }
        }
        Method::Spot(count) => {
            for i in 0..count {
                let light =
                    SpotLight { intensity: 1e5, range: 30.0, outer_angle: 0.3, shadow_maps_enabled: true, ..default() };
                let place = 8.0 * towards(i).normalize();
                world.spawn((light, Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y)));
            }
        }
        Method::Ssao => {
            world.entity_mut(camera).insert(ScreenSpaceAmbientOcclusion::default());
        }
    }
}
