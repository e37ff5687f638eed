//! Toy cars in a corner of two walls, under a sky with a movable lamp. A panel has all settings of the shadow dome.
//!
//! `cargo run --features egui --example shadow_lab`, or without a window
//! ```text
//! cargo run --features egui --example shadow_lab -- \
//!     --headless --frames 8 --out shadow_lab --directions 64 --filter gauss
//! ```
//!
//! Everything is virtual: there is no marker, no ball and no camera. In such a scene Freiling (2006) compared shadows.

mod options;
mod panel;
#[path = "../support/mod.rs"]
mod support;

use bevy::{
    app::AppExit, core_pipeline::tonemapping::Tonemapping, diagnostic::FrameTimeDiagnosticsPlugin,
    light::NotShadowCaster, prelude::*,
};
use bevy_egui::{EguiPlugin, EguiPrimaryContextPass};
use bevy_mirrorball::{
    environment_map::{EnvironmentCube, EquirectPixels, equirect_direction},
    headless,
    lighting::RealLight,
    materials::MaterialsPlugin,
    phantom::PhantomPlugin,
    prefilter::{LiveEnvironment, PrefilterPlugin, Refresh},
    shadows::{ShadowDomeLight, ShadowsPlugin},
};
use options::Options;
use std::f32::consts::TAU;
use support::{Outcome, fits_device, window_log};

/// Width of the sky's equirectangular image in pixels.
const SKY_WIDTH: u32 = 256;
/// Seconds per frame without a window, and frames per image: shadow maps need several frames to catch up.
const HEADLESS_STEP: f32 = 1.0 / 30.0;
const FRAMES_A_PICTURE: u32 = 6;
/// Number of frames after which roles, materials, light and the first shadow maps exist.
const WARM_UP_FRAMES: u32 = 6;

/// State of the lamp in the sky and of the cars.
#[derive(Resource, Clone, Debug, PartialEq)]
struct Lab {
    /// Angles around the vertical and above the horizon, in radians.
    azimuth: f32,
    elevation: f32,
    /// Angular radius of the lamp, in radians.
    radius: f32,
    /// Irradiance of a surface that faces the lamp, divided by the irradiance of the floor by the sky.
    strength: f32,
    /// Seconds since the cars have started, and the speed at which this time passes.
    time: f32,
    speed: f32,
}

impl Default for Lab {
    fn default() -> Self {
        Self { azimuth: 5.9, elevation: 0.8, radius: 0.1, strength: 3.0, time: 0.0, speed: 1.0 }
    }
}

impl Lab {
    /// Direction to the lamp.
    fn direction(&self) -> Vec3 {
        let (sin, cos) = self.elevation.sin_cos();
        Vec3::new(cos * self.azimuth.cos(), sin, cos * self.azimuth.sin())
    }
}

/// Circular path of a car: radius in meters, speed in radians per second, start in radians.
#[derive(Component, Clone, Copy)]
struct Drives {
    radius: f32,
    turn: f32,
    start: f32,
}

fn main() -> Outcome<AppExit> {
    let options = Options::from_command_line()?;
    if options.is_headless {
        draw_to_files(&options)?;
        return Ok(AppExit::Success);
    }
    let mut app = App::new();
    app.add_plugins((DefaultPlugins.set(window_log()), EguiPlugin::default(), FrameTimeDiagnosticsPlugin::default()))
        .add_systems(EguiPrimaryContextPass, panel::draw_panel);
    add_scene(&mut app, &options.dome);
    app.world_mut().spawn(camera());
    let advance = |time: Res<Time>, mut lab: ResMut<Lab>| {
        let step = time.delta_secs() * lab.speed;
        lab.time += step;
    };
    app.add_systems(Update, advance.before(drive));
    Ok(app.run())
}

fn draw_to_files(options: &Options) -> Outcome<()> {
    std::fs::create_dir_all(&options.out)?;
    let mut app = headless::build_app(headless::default_plugins(), |app| add_scene(app, &options.dome))?;
    fits_device(&app, options.size)?;
    let (picture, target) = headless::add_target(&mut app, options.size);
    app.world_mut().spawn((camera(), target));
    for _ in 0..WARM_UP_FRAMES {
        headless::update(&mut app)?;
    }
    headless::settle(&mut app)?;
    for frame in 0..options.frames {
        for _ in 1..FRAMES_A_PICTURE {
            app.world_mut().resource_mut::<Lab>().time += HEADLESS_STEP;
            app.update();
        }
        app.world_mut().resource_mut::<Lab>().time += HEADLESS_STEP;
        let bytes = headless::read_texture(&mut app, &picture)?;
        let file = options.out.join(format!("frame_{frame:04}.png"));
        image::save_buffer(&file, &bytes, options.size.x, options.size.y, image::ExtendedColorType::Rgba8)?;
    }
    println!("shadow_lab: {} pictures in {}", options.frames, options.out.display());
    Ok(())
}

fn camera() -> impl Bundle {
    (
        Camera3d::default(),
        Tonemapping::None,
        Transform::from_xyz(2.0, 1.9, 2.6).looking_at(Vec3::new(-0.15, 0.15, -0.1), Vec3::Y),
        AmbientLight { brightness: 0.0, ..default() },
    )
}

fn add_scene(app: &mut App, dome: &ShadowDomeLight) {
    app.add_plugins((PhantomPlugin, PrefilterPlugin, ShadowsPlugin, MaterialsPlugin))
        .init_resource::<Lab>()
        .insert_resource(ClearColor(Color::srgb(0.62, 0.68, 0.75)))
        .add_systems(Update, (drive, light_up));
    let world = app.world_mut();
    world.spawn(dome.clone());
    let mut add = Builder(world);
    let (floor, wall) = (Color::srgb(0.75, 0.72, 0.68), Color::srgb(0.8, 0.8, 0.78));
    let ground = add.part(Plane3d::default().mesh().size(3.4, 3.4), Vec3::ZERO, floor);
    // It lies below all receivers.
    add.0.entity_mut(ground).insert(NotShadowCaster);
    add.part(Cuboid::new(3.0, 1.0, 0.08), Vec3::new(0.0, 0.5, -1.44), wall);
    add.part(Cuboid::new(0.08, 1.0, 2.8), Vec3::new(-1.46, 0.5, 0.0), wall);
    let pole = add.part(Cylinder::new(0.02, 0.9), Vec3::new(0.05, 0.45, -0.05), Color::srgb(0.45, 0.46, 0.48));
    let sign = add.part(Cylinder::new(0.2, 0.02), Vec3::new(0.0, 0.42, 0.03), Color::srgb(0.8, 0.1, 0.08));
    let bar = add.part(Cuboid::new(0.26, 0.03, 0.06), Vec3::new(0.0, 0.01, 0.0), Color::WHITE);
    let towards_camera = Quat::from_rotation_y(0.6) * Quat::from_rotation_x(TAU / 4.0);
    add.0.entity_mut(bar).insert(ChildOf(sign));
    add.0.entity_mut(sign).insert((ChildOf(pole), Transform::from_xyz(0.02, 0.42, 0.03).with_rotation(towards_camera)));
    for (paint, radius, turn, start) in [
        (Color::srgb(0.85, 0.2, 0.1), 0.95, 0.8, 0.3),
        (Color::srgb(0.1, 0.35, 0.75), 0.95, 0.8, 2.6),
        (Color::srgb(0.95, 0.75, 0.15), 0.52, -1.3, 4.4),
    ] {
        let car = add.car(paint);
        add.0.entity_mut(car).insert(Drives { radius, turn, start });
    }
}

/// Spawns objects with one color each.
struct Builder<'w>(&'w mut World);

impl Builder<'_> {
    fn part(&mut self, mesh: impl Into<Mesh>, place: Vec3, base_color: Color) -> Entity {
        let mesh = self.0.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = StandardMaterial { base_color, perceptual_roughness: 0.6, ..default() };
        let material = self.0.resource_mut::<Assets<StandardMaterial>>().add(material);
        self.0.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place))).id()
    }

    /// Spawns a toy car, 36 cm long, that faces +X.
    fn car(&mut self, paint: Color) -> Entity {
        let car = self.0.spawn((Transform::default(), Visibility::default())).id();
        let glass = Color::srgb(0.12, 0.14, 0.18);
        let mut parts = vec![
            self.part(Cuboid::new(0.36, 0.07, 0.17), Vec3::new(0.0, 0.085, 0.0), paint),
            self.part(Cuboid::new(0.18, 0.07, 0.14), Vec3::new(-0.03, 0.15, 0.0), glass),
            self.part(Cuboid::new(0.17, 0.015, 0.145), Vec3::new(-0.03, 0.19, 0.0), paint),
        ];
        for (x, z) in [(0.11, 0.08), (0.11, -0.08), (-0.11, 0.08), (-0.11, -0.08)] {
            let wheel = self.part(Cylinder::new(0.05, 0.035), Vec3::ZERO, Color::srgb(0.06, 0.06, 0.06));
            let upright = Transform::from_xyz(x, 0.05, z).with_rotation(Quat::from_rotation_x(TAU / 4.0));
            self.0.entity_mut(wheel).insert(upright);
            parts.push(wheel);
        }
        self.0.entity_mut(car).add_children(&parts);
        car
    }
}

fn drive(lab: Res<Lab>, mut cars: Query<(&Drives, &mut Transform)>) {
    for (Drives { radius, turn, start }, mut transform) in &mut cars {
        let angle = start + turn * lab.time;
        let place = radius * Vec3::new(angle.cos(), 0.0, angle.sin());
        // The tangent is a quarter turn from the radius.
        let heading = -angle - turn.signum() * 0.25 * TAU;
        let now = Transform::from_translation(place).with_rotation(Quat::from_rotation_y(heading));
        // An unchanged transform does not trigger new shadow maps.
        transform.set_if_neq(now);
    }
}

/// Repaints the sky when the lamp has changed.
fn light_up(
    mut commands: Commands,
    lab: Res<Lab>,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<Entity, With<Camera3d>>,
    old: Query<Entity, Or<(With<EnvironmentCube>, With<RealLight>)>>,
    mut painted: Local<Option<Lab>>,
) {
    let lamp = Lab { time: 0.0, speed: 0.0, ..lab.clone() };
    let Ok(camera) = cameras.single() else {
        return;
    };
    if painted.as_ref() == Some(&lamp) {
        return;
    }
    let cube = images.add(sky(&lamp).to_cube(EnvironmentCube::SIZE, Quat::IDENTITY).to_image());
    for old in &old {
        commands.entity(old).despawn();
    }
    commands.spawn(EnvironmentCube(cube.clone()));
    // The light that `LightingPlugin` would detect in a measured map.
    commands.spawn(RealLight {
        id: 0,
        direction: lamp.direction(),
        position: None,
        color: LinearRgba::WHITE,
        irradiance: lamp.strength,
        angular_radius: lamp.radius,
        fraction: lamp.strength / (1.0 + lamp.strength),
    });
    commands.entity(camera).insert(LiveEnvironment::new(cube).with_refresh(Refresh::OnChange));
    *painted = Some(lamp);
}

fn sky(lamp: &Lab) -> EquirectPixels {
    let towards_lamp = lamp.direction();
    let size = UVec2::new(SKY_WIDTH, SKY_WIDTH / 2);
    // A disc with a soft edge of one pixel, and at least that radius.
    let edge = TAU / SKY_WIDTH as f32;
    let radius = lamp.radius.max(edge);
    let on_disc = 0.35 * lamp.strength / (radius * radius);
    let radiance = |i: u32| {
        let uv = (Vec2::new((i % size.x) as f32, (i / size.x) as f32) + 0.5) / size.as_vec2();
        let dir = equirect_direction(uv);
        let air = Vec3::new(0.42, 0.46, 0.5).lerp(Vec3::new(0.22, 0.32, 0.48), dir.y.max(0.0).sqrt());
        let ground = Vec3::new(0.16, 0.15, 0.14);
        let off = (dir.angle_between(towards_lamp) - radius) / edge;
        let share = (0.5 - off).clamp(0.0, 1.0);
        ground.lerp(air, ((dir.y + 0.02) / 0.04).clamp(0.0, 1.0)) + share * on_disc * Vec3::new(1.0, 0.9, 0.75)
    };
    EquirectPixels { size, texels: (0..size.x * size.y).map(radiance).collect() }
}
