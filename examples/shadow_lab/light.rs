//! The sky with its lamp, which can be dragged.

use crate::{Lab, method, method::Method};
use bevy::{camera::Exposure, light::NotShadowCaster, prelude::*};
use bevy_egui::input::EguiWantsInput;
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels, equirect_direction},
    lighting::RealLight,
    prefilter::{LiveEnvironment, Refresh},
};
// Games have these with Bevy's default features, as `bevy::picking`.
use bevy_picking::events::{Drag, Pointer};
use std::f32::consts::{PI, TAU};

/// Width of the sky's equirectangular image in pixels.
const SKY_WIDTH: u32 = 256;
const LAMP_COLOR: LinearRgba = LinearRgba::rgb(1.0, 0.9, 0.75);
/// Irradiance of the floor by the sky, nearly, in the units of the map.
const SKY_IRRADIANCE: f32 = 1.1;
/// Distance of the ball that stands for the lamp, in meters.
const BALL_DISTANCE: f32 = 1.6;
/// Radians that the lamp moves per pixel that it is dragged.
const DRAG: f32 = 0.005;

/// A lamp in the sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lamp {
    /// Angles around the vertical and above the horizon, in radians.
    pub azimuth: f32,
    pub elevation: f32,
    /// Angular radius in radians.
    pub radius: f32,
    /// Irradiance of a surface that faces the lamp, divided by the irradiance of the floor by the sky.
    pub strength: f32,
}

impl Default for Lamp {
    fn default() -> Self {
        Self { azimuth: 5.9, elevation: 0.8, radius: 0.1, strength: 3.0 }
    }
}

impl Lamp {
    pub(crate) const ELEVATIONS: std::ops::RangeInclusive<f32> = 0.1..=1.55;

    /// Direction to the lamp.
    fn direction(&self) -> Vec3 {
        let (sin, cos) = self.elevation.sin_cos();
        Vec3::new(cos * self.azimuth.cos(), sin, cos * self.azimuth.sin())
    }

    /// Irradiance of a surface that faces it, in the units of the map.
    fn irradiance(&self) -> f32 {
        SKY_IRRADIANCE * self.strength
    }
}

/// The ball that stands for the lamp.
#[derive(Component)]
pub(crate) struct LampBall;

/// Adds the ball for windows, where it can be dragged.
pub(crate) fn spawn_ball(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    let glow = StandardMaterial { base_color: LAMP_COLOR.into(), unlit: true, ..default() };
    commands
        .spawn((
            LampBall,
            Mesh3d(meshes.add(Sphere::new(0.05))),
            MeshMaterial3d(materials.add(glow)),
            Transform::default(),
            NotShadowCaster,
        ))
        .observe(|drag: On<Pointer<Drag>>, mut lab: ResMut<Lab>, panel: Res<EguiWantsInput>| {
            if !panel.wants_any_pointer_input() {
                let lamp = &mut lab.lamp;
                lamp.azimuth = (lamp.azimuth + DRAG * drag.delta.x).rem_euclid(TAU);
                let elevation = lamp.elevation - DRAG * drag.delta.y;
                lamp.elevation = elevation.clamp(*Lamp::ELEVATIONS.start(), *Lamp::ELEVATIONS.end());
            }
        });
}

pub(crate) fn move_ball(lab: Res<Lab>, mut balls: Query<&mut Transform, With<LampBall>>) {
    for mut ball in &mut balls {
        ball.set_if_neq(Transform::from_translation(BALL_DISTANCE * lab.lamp.direction()));
    }
}

/// Repaints the sky when the lamp has changed.
pub(crate) fn light_up(
    mut commands: Commands,
    lab: Res<Lab>,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<Entity, With<Camera3d>>,
    old: Query<Entity, Or<(With<EnvironmentCube>, With<RealLight>, With<DirectionalLight>)>>,
    mut painted: Local<Option<(Lamp, bool)>>,
) {
    let Ok(camera) = cameras.single() else {
        return;
    };
    let (lamp, is_engines) = (lab.lamp, lab.method == Method::Map);
    if *painted == Some((lamp, is_engines)) {
        return;
    }
    let cube = images.add(sky(&lamp, !is_engines).to_cube(EnvironmentCube::SIZE, Quat::IDENTITY).to_image());
    for old in &old {
        commands.entity(old).despawn();
    }
    commands.spawn(EnvironmentCube(cube.clone()));
    if is_engines {
        let illuminance = lamp.irradiance() / Exposure::default().exposure();
        commands.spawn(method::lamp_with_map(lamp.direction(), LAMP_COLOR.into(), illuminance));
    } else {
        // The light that `LightingPlugin` would detect in a measured map.
        commands.spawn(RealLight {
            id: 0,
            direction: lamp.direction(),
            position: None,
            color: LAMP_COLOR,
            irradiance: lamp.irradiance(),
            angular_radius: lamp.radius,
            fraction: lamp.strength / (1.0 + lamp.strength),
        });
    }
    commands.entity(camera).insert(LiveEnvironment::new(cube).with_refresh(Refresh::OnChange));
    *painted = Some((lamp, is_engines));
}

fn sky(lamp: &Lamp, has_lamp: bool) -> EquirectPixels {
    let towards_lamp = lamp.direction();
    let size = UVec2::new(SKY_WIDTH, SKY_WIDTH / 2);
    // A disc with a soft edge of one pixel, and at least that radius.
    let edge = TAU / SKY_WIDTH as f32;
    let radius = lamp.radius.max(edge);
    let on_disc = if has_lamp { lamp.irradiance() / (PI * radius * radius) } else { 0.0 };
    let radiance = |i: u32| {
        let uv = (Vec2::new((i % size.x) as f32, (i / size.x) as f32) + 0.5) / size.as_vec2();
        let dir = equirect_direction(uv);
        let air = Vec3::new(0.42, 0.46, 0.5).lerp(Vec3::new(0.22, 0.32, 0.48), dir.y.max(0.0).sqrt());
        let ground = Vec3::new(0.16, 0.15, 0.14);
        let off = (dir.angle_between(towards_lamp) - radius) / edge;
        let share = (0.5 - off).clamp(0.0, 1.0);
        ground.lerp(air, ((dir.y + 0.02) / 0.04).clamp(0.0, 1.0)) + share * on_disc * LAMP_COLOR.to_vec3()
    };
    EquirectPixels { size, texels: (0..size.x * size.y).map(radiance).collect() }
}
