//! Toy cars drive in a corner of two walls, under a sky whose lamp can be moved; every setting of the dome is in a panel.
//!
//! `cargo run --features egui --example shadow_lab`, or without a window
//! `cargo run --features egui --example shadow_lab -- --headless --frames 8 --out shadow_lab --directions 64 --filter gauss`.
//!
//! All is virtual: no marker, no ball, no camera picture. The scene is the one in which Kunze (2006) compared shadows.

use bevy::{
    app::AppExit, core_pipeline::tonemapping::Tonemapping, diagnostic::FrameTimeDiagnosticsPlugin,
    light::NotShadowCaster, log::LogPlugin, prelude::*,
};
use bevy_egui::{EguiContexts, EguiPlugin, EguiPrimaryContextPass, egui};
use bevy_mirrorball::{
    environment_map::EnvironmentCube,
    environment_map::{EquirectPixels, equirect_direction},
    lighting::RealLight,
    materials::MaterialsPlugin,
    offscreen,
    phantom::PhantomPlugin,
    prefilter::{LiveEnvironment, PrefilterPlugin, Refresh},
    shadows::{DomeCoverage, DomeState, ShadowDomeLight, ShadowFilter, ShadowsPlugin, VisibilitySamples},
};
use std::{f32::consts::TAU, path::PathBuf};

/// Width of the sky's picture, and edge of the cube made of it.
const SKY_WIDTH: u32 = 256;
/// Seconds from frame to frame without a window, and frames from picture to picture: shadow maps need some to follow.
const HEADLESS_STEP: f32 = 1.0 / 30.0;
const FRAMES_A_PICTURE: u32 = 6;
/// In so many frames roles, materials, light and first shadow maps are there.
const WARM_UP_FRAMES: u32 = 6;
/// What the command line calls filters.
const FILTERS: [(&str, ShadowFilter); 7] = [
    ("nearest", ShadowFilter::Nearest),
    ("bilinear", ShadowFilter::Bilinear),
    ("gauss", ShadowFilter::Gauss),
    ("pcf9", ShadowFilter::Pcf9),
    ("pcf25", ShadowFilter::Pcf25),
    ("pcf49", ShadowFilter::Pcf49),
    ("pcss", SOFT),
];
const SOFT: ShadowFilter = ShadowFilter::Pcss { angular_radius: 0.1 };
const SAMPLES: [(&str, VisibilitySamples); 4] = [
    ("interleaved", VisibilitySamples::Interleaved),
    ("half", VisibilitySamples::Half),
    ("full", VisibilitySamples::Full),
    ("fragment", VisibilitySamples::Fragment),
];
const COVERAGES: [(&str, DomeCoverage); 2] =
    [("hemisphere", DomeCoverage::Hemisphere), ("sphere", DomeCoverage::Sphere)];
const RESOLUTIONS: [(&str, u32); 5] = [("64", 64), ("128", 128), ("256", 256), ("512", 512), ("1024", 1024)];

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

struct Options {
    is_headless: bool,
    frames: u32,
    size: UVec2,
    out: PathBuf,
    dome: ShadowDomeLight,
}

/// A value by its name on the command line.
fn named<T: Copy>(values: &[(&str, T)], option: &str, name: &str) -> Result<T, String> {
    let names: Vec<_> = values.iter().map(|(name, _)| *name).collect();
    let found = values.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
    found.ok_or(format!("--{option}: {name} is none of {}", names.join(", ")))
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self {
            is_headless: false,
            frames: 4,
            size: UVec2::new(640, 360),
            out: PathBuf::from("shadow_lab"),
            dome: ShadowDomeLight::default(),
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("headless") => options.is_headless = true,
                Long("frames") => options.frames = parser.value()?.parse()?,
                Long("size") => {
                    let text = parser.value()?.string()?;
                    let size =
                        text.split_once('x').and_then(|(x, y)| Some(UVec2::new(x.parse().ok()?, y.parse().ok()?)));
                    options.size = size.filter(|size| size.min_element() > 0).ok_or("--size: write it like 640x360")?;
                }
                Long("out") => options.out = parser.value()?.into(),
                Long("directions") => options.dome.directions = parser.value()?.parse()?,
                Long("resolution") => options.dome.resolution = parser.value()?.parse()?,
                Long("refreshed") => options.dome.refreshed_per_frame = parser.value()?.parse()?,
                Long("key-lights") => options.dome.key_lights = parser.value()?.parse()?,
                Long("filter") => options.dome.filter = named(&FILTERS, "filter", &parser.value()?.string()?)?,
                Long("samples") => options.dome.samples = named(&SAMPLES, "samples", &parser.value()?.string()?)?,
                Long("coverage") => options.dome.coverage = named(&COVERAGES, "coverage", &parser.value()?.string()?)?,
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// The lamp in the sky and the cars' time.
#[derive(Resource, Clone, Debug, PartialEq)]
struct Lab {
    /// Radians around the vertical, and above the horizon.
    azimuth: f32,
    elevation: f32,
    /// Half of the angle at which the lamp is seen, in radians.
    radius: f32,
    /// Irradiance of a surface that faces the lamp ÷ that of the sky around it on the floor.
    strength: f32,
    /// Seconds since the cars have started, and how fast they pass.
    time: f32,
    speed: f32,
}

impl Default for Lab {
    fn default() -> Self {
        Self { azimuth: 5.9, elevation: 0.8, radius: 0.1, strength: 3.0, time: 0.0, speed: 1.0 }
    }
}

impl Lab {
    /// Towards the lamp.
    fn direction(&self) -> Vec3 {
        let (sin, cos) = self.elevation.sin_cos();
        Vec3::new(cos * self.azimuth.cos(), sin, cos * self.azimuth.sin())
    }
}

/// Which way a car goes around: radius in metres, radians per second, radians at the start.
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
    let log = LogPlugin { filter: "warn,wgpu=error,winit=error,bevy_egui=error".to_owned(), ..default() };
    app.add_plugins((DefaultPlugins.set(log), EguiPlugin::default(), FrameTimeDiagnosticsPlugin::default()))
        .add_systems(EguiPrimaryContextPass, draw_panel);
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
    let mut app = offscreen::build_app(offscreen::default_plugins(), |app| add_scene(app, &options.dome))?;
    let (picture, target) = offscreen::add_target(&mut app, options.size);
    app.world_mut().spawn((camera(), target));
    for _ in 0..WARM_UP_FRAMES {
        offscreen::update(&mut app)?;
    }
    offscreen::settle(&mut app)?;
    for frame in 0..options.frames {
        for _ in 1..FRAMES_A_PICTURE {
            app.world_mut().resource_mut::<Lab>().time += HEADLESS_STEP;
            app.update();
        }
        app.world_mut().resource_mut::<Lab>().time += HEADLESS_STEP;
        let bytes = offscreen::read_texture(&mut app, &picture)?;
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
    // It is below everything that receives.
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

/// Spawns things of one color.
struct Builder<'w>(&'w mut World);

impl Builder<'_> {
    fn part(&mut self, mesh: impl Into<Mesh>, place: Vec3, base_color: Color) -> Entity {
        let mesh = self.0.resource_mut::<Assets<Mesh>>().add(mesh);
        let material = StandardMaterial { base_color, perceptual_roughness: 0.6, ..default() };
        let material = self.0.resource_mut::<Assets<StandardMaterial>>().add(material);
        self.0.spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place))).id()
    }

    /// A toy car, 36 cm long, that looks along +X.
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
        // A quarter turn on from the way out.
        let heading = -angle - turn.signum() * 0.25 * TAU;
        let now = Transform::from_translation(place).with_rotation(Quat::from_rotation_y(heading));
        // Cars that stand still leave their shadow maps alone.
        transform.set_if_neq(now);
    }
}

/// Paints the sky anew when the lamp has moved.
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
    // What the plugin for lighting would find in a measured map.
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
    // A disc with a soft edge, as wide as the sky's pixels can show it.
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

fn draw_panel(
    mut contexts: EguiContexts,
    mut lab: ResMut<Lab>,
    mut domes: Query<(&mut ShadowDomeLight, &DomeState)>,
    diagnostics: Res<bevy::diagnostic::DiagnosticsStore>,
) {
    let (Ok(ctx), Ok((mut dome, state))) = (contexts.ctx_mut(), domes.single_mut()) else {
        return;
    };
    let (mut lamp, mut settings) = (lab.clone(), dome.clone());
    egui::Window::new("dome").default_width(280.0).show(ctx, |ui| {
        draw_dome(ui, &mut settings);
        ui.separator();
        ui.add(egui::Slider::new(&mut lamp.azimuth, 0.0..=TAU).text("lamp: azimuth"));
        ui.add(egui::Slider::new(&mut lamp.elevation, 0.1..=1.55).text("elevation"));
        ui.add(egui::Slider::new(&mut lamp.radius, 0.02..=0.6).text("angular radius"));
        ui.add(egui::Slider::new(&mut lamp.strength, 0.0..=6.0).text("strength"));
        ui.add(egui::Slider::new(&mut lamp.speed, 0.0..=3.0).text("cars' speed"));
        ui.separator();
        ui.label(format!(
            "{} casters · {} key lights · {} directions redrawn, {} outdated · the oldest of {} main ones is {} frames old",
            state.casters, state.key_lights, state.redrawn, state.outdated, state.main, state.oldest_main
        ));
        let frame = diagnostics.get(&FrameTimeDiagnosticsPlugin::FRAME_TIME).and_then(|time| time.smoothed());
        ui.label(format!("{:.1} ms a frame", frame.unwrap_or(0.0)));
    });
    lab.set_if_neq(lamp);
    dome.set_if_neq(settings);
}

/// One line per field.
fn draw_dome(ui: &mut egui::Ui, dome: &mut ShadowDomeLight) {
    let most = ShadowDomeLight::MAX_DIRECTIONS;
    ui.add(egui::Slider::new(&mut dome.directions, 1..=most).logarithmic(true).text("directions"));
    ui.add(egui::Slider::new(&mut dome.key_lights, 0..=ShadowDomeLight::MAX_KEY_LIGHTS).text("key lights"));
    choose(ui, "coverage", &COVERAGES, &mut dome.coverage);
    choose(ui, "resolution", &RESOLUTIONS, &mut dome.resolution);
    // The width of a soft filter has a slider of its own.
    let mut filter = if let ShadowFilter::Pcss { .. } = dome.filter { SOFT } else { dome.filter };
    choose(ui, "filter", &FILTERS, &mut filter);
    if std::mem::discriminant(&filter) != std::mem::discriminant(&dome.filter) {
        dome.filter = filter;
    }
    if let ShadowFilter::Pcss { angular_radius } = &mut dome.filter {
        ui.add(egui::Slider::new(angular_radius, 0.0..=0.5).text("light's angular radius"));
    }
    choose(ui, "samples", &SAMPLES, &mut dome.samples);
    ui.add(egui::Slider::new(&mut dome.refreshed_per_frame, 1..=most).logarithmic(true).text("refreshed per frame"));
    ui.add(egui::Slider::new(&mut dome.dim_share, 0.0..=0.2).text("share of dim directions"));
}

/// A box with names.
fn choose<T: Copy + PartialEq>(ui: &mut egui::Ui, label: &str, values: &[(&str, T)], chosen: &mut T) {
    let current = values.iter().find(|(_, value)| value == chosen);
    egui::ComboBox::from_label(label).selected_text(current.map_or("other", |(name, _)| *name)).show_ui(ui, |ui| {
        for (name, value) in values {
            ui.selectable_value(chosen, *value, *name);
        }
    });
}
