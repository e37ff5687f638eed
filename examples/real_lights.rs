//! The lights detected on a recorded desk as labeled arrows, without and with the recovery of clipped light, side by
//! side.
//!
//! ```text
//! cargo run --example real_lights -- --picture 20 --out real_lights.png
//! ```
//! On the left, clipped light counts as white; on the right, its energy is recovered from the objects on the desk. Each
//! arrow points in the direction in which a light shines and has the light's color; its length grows with the light's
//! fraction of all light. The label shows the light's number, its fraction of all light in percent and its elevation in
//! degrees. Needs no window; renders on software Vulkan too.

#[path = "support/mod.rs"]
mod support;

use bevy::{asset::RecursiveDependencyLoadState, light::NotShadowCaster, prelude::*};
use bevy_mirrorball::{
    headless,
    lighting::{RealLight, RecoveredLight},
    prelude::*,
    probe::ClipRecovery,
    tracking::MarkerTracking,
};
use lexopt::prelude::*;
use std::{
    path::PathBuf,
    process::ExitCode,
    time::{Duration, Instant},
};
use support::{Outcome, exit_code, rgb_image};

const USAGE: &str = "\
Shows the lights found on the recorded desk.

usage: real_lights [--picture N] [--out FILE]

  --picture N   picture of assets/desk_clip, 0 to 59 [20]
  --out FILE    where the picture goes (PNG) [real_lights.png]
";
/// Size and focal length of the recorded frames, in pixels.
const SIZE: UVec2 = UVec2::new(640, 480);
const FOCAL: f32 = 601.832_46;
/// Longest wait for assets and shaders.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Point at which the arrows point, in the marker's frame of reference, in meters.
const TARGET: Vec3 = Vec3::new(-0.02, 0.02, -0.01);

fn main() -> ExitCode {
    exit_code("real_lights", run())
}

fn run() -> Outcome<()> {
    let (mut picture, mut out) = (20_u32, PathBuf::from("real_lights.png"));
    let mut arguments = lexopt::Parser::from_env();
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("picture") => picture = arguments.value()?.parse()?,
            Long("out") => out = arguments.value()?.into(),
            Long("help") | Short('h') => {
                println!("{USAGE}");
                return Ok(());
            }
            other => return Err(format!("{}\n\n{USAGE}", other.unexpected()).into()),
        }
    }
    let mut both = image::RgbImage::new(2 * SIZE.x, SIZE.y);
    for (side, is_enabled) in [false, true].into_iter().enumerate() {
        println!("{}", if is_enabled { "recovered:" } else { "clipped light taken for white:" });
        let half = draw(picture, is_enabled)?;
        image::imageops::replace(&mut both, &half, i64::from(SIZE.x) * side as i64, 0);
    }
    both.save(&out).map_err(|error| format!("cannot write {}: {error}", out.display()))?;
    println!("{}", out.display());
    Ok(())
}

fn draw(picture: u32, is_enabled: bool) -> Outcome<image::RgbImage> {
    let file = format!("assets/desk_clip/frame_{picture:03}.jpg");
    if !std::path::Path::new(&file).exists() {
        return Err(
            format!("{file} does not exist: --picture takes 0 to 59; run from the root of the repository").into()
        );
    }
    let mut app = headless::build_app(headless::default_plugins(), |app| {
        app.add_plugins(MirrorballPlugins).add_systems(Update, show_arrows);
    })?;
    let (texture, target) = headless::add_target(&mut app, SIZE);
    let intrinsics = Intrinsics::new(Vec2::splat(FOCAL), SIZE.as_vec2() / 2.0, SIZE);
    let feed = CameraFeed::file(file).with_pace(FeedPace::Lockstep);
    let camera = Camera { is_active: false, ..default() };
    let camera = app.world_mut().spawn((ArCamera::new(intrinsics), camera, target, feed)).id();
    let scene: Handle<WorldAsset> =
        app.world().resource::<AssetServer>().load(GltfAssetLabel::Scene(0).from_asset("desk/desk.glb"));
    app.world_mut().spawn(WorldAssetRoot(scene.clone()));
    app.world_mut().spawn(ShadowDomeLight::default());
    let started = Instant::now();
    while !is_ready(&mut app, &scene, is_enabled)? {
        headless::update(&mut app)?;
        std::thread::sleep(Duration::from_millis(1));
        if started.elapsed() > MAX_WAIT {
            return Err("the lights were not found: is the marker in the picture?".into());
        }
    }
    if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
        camera.is_active = true;
    }
    headless::settle(&mut app)?;
    let pixels = headless::read_texture(&mut app, &texture)?;
    let mut picture = rgb_image(SIZE, &pixels)?;
    write_labels(&mut app, &mut picture, intrinsics);
    Ok(picture)
}

/// Switches the recovery on or off, and returns whether the scene is loaded and its lights are detected.
fn is_ready(app: &mut App, scene: &Handle<WorldAsset>, is_enabled: bool) -> Outcome<bool> {
    let assets = app.world().resource::<AssetServer>().clone();
    if let Some(RecursiveDependencyLoadState::Failed(error)) = assets.get_recursive_dependency_load_state(scene) {
        return Err(format!("cannot load the desk: {error}").into());
    }
    let world = app.world_mut();
    for mut recovery in world.query::<&mut ClipRecovery>().iter_mut(world) {
        if recovery.is_enabled != is_enabled {
            recovery.is_enabled = is_enabled;
        }
    }
    let is_found = world
        .query::<(&RecoveredLight, &ClipRecovery)>()
        .iter(world)
        .any(|(light, recovery)| light.is_solved == is_enabled && recovery.is_enabled == is_enabled);
    Ok(is_found && assets.is_loaded_with_dependencies(scene))
}

/// The arrow of a light.
#[derive(Component)]
struct Arrow;

fn show_arrows(
    mut commands: Commands,
    lights: Query<&RealLight, Changed<RealLight>>,
    arrows: Query<Entity, With<Arrow>>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) {
    if lights.is_empty() {
        return;
    }
    for arrow in &arrows {
        commands.entity(arrow).despawn();
    }
    for light in &lights {
        let length = length(light);
        let material = materials.add(StandardMaterial { base_color: light.color.into(), unlit: true, ..default() });
        let shaft = meshes.add(Cylinder::new(0.0022, length));
        let tip = meshes.add(Cone::new(0.007, 0.02));
        let turn = Quat::from_rotation_arc(Vec3::NEG_Y, light.direction);
        let middle = TARGET + light.direction * (0.07 + 0.5 * length);
        commands.spawn((
            Arrow,
            Transform::from_translation(middle).with_rotation(turn),
            Visibility::default(),
            children![
                (Mesh3d(shaft), MeshMaterial3d(material.clone()), NotShadowCaster),
                (
                    Mesh3d(tip),
                    MeshMaterial3d(material),
                    NotShadowCaster,
                    Transform::from_xyz(0.0, 0.5 * length + 0.01, 0.0)
                ),
            ],
        ));
    }
}

fn length(light: &RealLight) -> f32 {
    0.04 + 0.12 * light.fraction.sqrt()
}

fn write_labels(app: &mut App, picture: &mut image::RgbImage, intrinsics: Intrinsics) {
    let world = app.world_mut();
    let mut lights: Vec<RealLight> = world.query::<&RealLight>().iter(world).copied().collect();
    lights.sort_by(|a, b| b.fraction.total_cmp(&a.fraction));
    let Some(pose) = world.query::<&MarkerTracking>().iter(world).find_map(|tracking| tracking.camera_from_marker)
    else {
        return;
    };
    let mut labels: Vec<(IVec2, IVec2)> = Vec::new();
    for light in lights {
        let elevation = light.direction.y.asin().to_degrees();
        let azimuth = light.direction.x.atan2(-light.direction.z).to_degrees();
        println!(
            "  light {}: elevation {elevation:.1}°, azimuth {azimuth:.1}° (from -Z to +X), {}, radius {:.1}°, {:.1} % of all light",
            light.id,
            light.position.map_or("far away".into(), |position| format!("{:.1} m away", position.distance(TARGET))),
            light.angular_radius.to_degrees(),
            100.0 * light.fraction
        );
        let end = TARGET + light.direction * (0.085 + length(&light));
        if let Some(pixel) = intrinsics.project(pose.transform_point(end).into()) {
            let label = format!("{}: {:.0}% {elevation:.0}°", light.id, 100.0 * light.fraction);
            let size = IVec2::new(8 * label.chars().count() as i32 + 2, 15);
            let mut at = pixel.as_ivec2() - IVec2::new(size.x / 2, 10);
            while let Some((other, _)) = labels
                .iter()
                .find(|(other, other_size)| at.cmplt(*other + *other_size).all() && (*other).cmplt(at + size).all())
            {
                at.y = other.y - size.y;
            }
            labels.push((at, size));
            write(picture, at, &label);
        }
    }
}

/// Digits and signs of 3 × 5 dots: rows from top to bottom; the highest of three bits is the leftmost dot.
const FONT: [(char, [u8; 5]); 14] = [
    ('0', [7, 5, 5, 5, 7]),
    ('1', [2, 6, 2, 2, 7]),
    ('2', [7, 1, 7, 4, 7]),
    ('3', [7, 1, 3, 1, 7]),
    ('4', [5, 5, 7, 1, 1]),
    ('5', [7, 4, 7, 1, 7]),
    ('6', [7, 4, 7, 5, 7]),
    ('7', [7, 1, 1, 2, 2]),
    ('8', [7, 5, 7, 5, 7]),
    ('9', [7, 5, 7, 1, 7]),
    (':', [0, 2, 0, 2, 0]),
    ('%', [5, 1, 2, 4, 5]),
    ('°', [2, 5, 2, 0, 0]),
    ('-', [0, 0, 7, 0, 0]),
];

fn write(picture: &mut image::RgbImage, at: IVec2, text: &str) {
    let mut dot = |x: i32, y: i32, color: [u8; 3]| {
        if x >= 0 && y >= 0 && x < picture.width() as i32 && y < picture.height() as i32 {
            picture.put_pixel(x as u32, y as u32, image::Rgb(color));
        }
    };
    let width = 8 * text.chars().count() as i32;
    for y in -2..12 {
        for x in -2..width {
            dot(at.x + x, at.y + y, [20, 20, 20]);
        }
    }
    for (i, letter) in text.chars().enumerate() {
        let rows = FONT.iter().find(|(known, _)| *known == letter).map_or([0; 5], |(_, rows)| *rows);
        for (y, row) in rows.into_iter().enumerate() {
            for x in (0..3).filter(|x| row & (4 >> x) != 0) {
                for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    dot(at.x + 8 * i as i32 + 2 * x + dx, at.y + 2 * y as i32 + dy, [255, 255, 255]);
                }
            }
        }
    }
}
