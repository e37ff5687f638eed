//! All eight combinations of a real or virtual light, occluder and shadow receiver, side by side.
//!
//! `cargo run --example eight_cases -- --out eight_cases.png`
//!
//! The background is a photograph of a desk with a can on it. The real light is that of the room, measured in the
//! mirrored ball; the virtual light is a spot light of Bevy. The virtual can is yellow, the virtual plate white. Where
//! all three are real, the result is the unchanged photograph. Needs no window; renders on software Vulkan too.
//! `--shrink 4` draws a quarter of the size, without captions, for a quick look.

#[path = "../support/mod.rs"]
mod support;

use bevy::{asset::RecursiveDependencyLoadState, camera::ShadowLodOrigin, prelude::*};
use bevy_mirrorball::{
    camera::FramePixels, environment_map::EnvironmentCube, headless, prelude::*, shadows::DomeState,
};
use image::{Rgb, RgbImage, imageops};
use std::{
    path::PathBuf,
    process::ExitCode,
    time::{Duration, Instant},
};
use support::{Outcome, captions, exit_code, headless_log, rgb_image};

const PHOTO: &str = "assets/desk/photo.jpg";
const SCENE: &str = "desk/set.glb";
const FOCAL: f32 = 601.83;
/// Corner and size of the part of the photograph that is shown, in pixels.
const CORNER: UVec2 = UVec2::new(200, 190);
const PART: UVec2 = UVec2::new(430, 290);
/// Space between and around the images, and height of a caption, in pixels.
const MARGIN: u32 = 8;
/// Largest reduction, at which a can is still some pixels wide.
const MAX_SHRINK: u32 = 8;
const CAPTION: u32 = 44;
const PAPER: Rgb<u8> = Rgb([24, 24, 26]);
const REAL: Rgb<u8> = Rgb([235, 235, 235]);
const VIRTUAL: Rgb<u8> = Rgb([255, 176, 64]);
/// Longest wait for assets and shaders that load in the background, and for shadow maps.
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Number of frames after which roles, materials and lights have reached the renderer.
const MIN_SETTLING_FRAMES: u32 = 4;

/// Size and positions of both cans. The scene file contains the position of the real one too.
const CAN: Cylinder = Cylinder { radius: 0.03, half_height: 0.045 };
const REAL_CAN: Vec3 = Vec3::new(-0.285, 0.045, -0.1);
const VIRTUAL_CAN: Vec3 = Vec3::new(-0.13, 0.045, -0.08);
/// Offsets from a can to the plate beside it, and from the point at which the lamp is aimed to the lamp.
const TO_PLATE: Vec3 = Vec3::new(0.115, -0.04, -0.02);
const TO_LAMP: Vec3 = Vec3::new(-0.36, 0.4, 0.12);

/// A combination: which of the three are virtual.
#[derive(Clone, Copy)]
struct Case {
    light: bool,
    blocker: bool,
    receiver: bool,
}

fn main() -> ExitCode {
    exit_code("eight_cases", draw())
}

fn draw() -> Outcome<()> {
    use lexopt::prelude::*;
    let (mut out, mut shrink) = (PathBuf::from("eight_cases.png"), 1);
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("out") => out = parser.value()?.into(),
            Long("shrink") => shrink = parser.value()?.parse::<u32>()?,
            // Accepted for consistency; there is no other mode.
            Long("headless") => (),
            other => return Err(other.unexpected().into()),
        }
    }
    if !(1..=MAX_SHRINK).contains(&shrink) {
        return Err(format!("--shrink: {shrink} is not in 1 to {MAX_SHRINK}").into());
    }
    let frame = FramePixels::open(PHOTO).map_err(|error| format!("run it in the crate's folder: {error}"))?;
    let (frame_size, size) = (frame.size, frame.size / shrink);
    let mut app = headless::build_app(headless::default_plugins(), |app| {
        app.add_plugins((headless_log(), MirrorballPlugins));
    })?;
    let (picture, target) = headless::add_target(&mut app, size);
    let feed = CameraFeed::pixels(frame).with_pace(FeedPace::Lockstep);
    let intrinsics = Intrinsics::new(Vec2::splat(FOCAL), frame_size.as_vec2() / 2.0, frame_size);
    app.world_mut().spawn((ArCamera::new(intrinsics), feed, target, ShadowLodOrigin));
    load(&mut app)?;

    let (corner, part) = (CORNER / shrink, PART / shrink);
    let caption = if shrink == 1 { CAPTION } else { 0 };
    let cell = part + UVec2::new(MARGIN, MARGIN + caption);
    let mut sheet = RgbImage::from_pixel(4 * cell.x + MARGIN, 2 * cell.y + MARGIN, PAPER);
    for i in 0..8 {
        let case = Case { light: i & 4 != 0, blocker: i & 2 != 0, receiver: i & 1 != 0 };
        let things = spawn(&mut app, case);
        settle(&mut app)?;
        let bytes = headless::read_texture(&mut app, &picture)?;
        for thing in things {
            app.world_mut().despawn(thing);
        }
        let whole = rgb_image(size, &bytes)?;
        let shown = imageops::crop_imm(&whole, corner.x, corner.y, part.x, part.y).to_image();
        let at = UVec2::splat(MARGIN) + UVec2::new(i % 4, i / 4) * cell;
        imageops::replace(&mut sheet, &shown, at.x.into(), (at.y + caption).into());
        if caption > 0 {
            write_caption(&mut sheet, at + UVec2::new(2, 6), case);
        }
    }
    sheet.save(&out).map_err(|error| format!("cannot write {}: {error}", out.display()))?;
    println!("eight_cases: see {}", out.display());
    Ok(())
}

/// Writes the caption of a case: the light in the first line, occluder and receiver in the second.
fn write_caption(sheet: &mut RgbImage, corner: UVec2, case: Case) {
    let mut write = |at, is_virtual, [real_name, virtual_name]: [&str; 2]| {
        let (name, color) = if is_virtual { (virtual_name, VIRTUAL) } else { (real_name, REAL) };
        captions::write(sheet, at, 2, color, name)
    };
    write(corner, case.light, ["REAL LIGHT", "VIRTUAL LAMP"]);
    let end = write(corner + UVec2::new(0, 18), case.blocker, ["REAL CAN", "VIRTUAL CAN"]);
    write(end + UVec2::new(18, 0), case.receiver, ["REAL DESK", "VIRTUAL PLATE"]);
}

/// Loads the scene and waits for its phantoms and for the light measured in the ball.
fn load(app: &mut App) -> Outcome<()> {
    let assets = app.world().resource::<AssetServer>().clone();
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(SCENE));
    app.world_mut().spawn(WorldAssetRoot(scene.clone()));
    let started = Instant::now();
    while started.elapsed() < MAX_WAIT {
        headless::settle(app)?;
        if let Some(RecursiveDependencyLoadState::Failed(error)) = assets.get_recursive_dependency_load_state(&scene) {
            return Err(format!("cannot load assets/{SCENE}: {error}").into());
        }
        let world = app.world_mut();
        let cube = world.query::<&EnvironmentCube>().iter(world).next().map(|cube| cube.0.clone());
        if let Some(cube) = cube
            && headless::read_texture(app, &cube)?.iter().any(|byte| *byte != 0)
        {
            return Ok(());
        }
    }
    Err(format!("assets/{SCENE} has not loaded, or the ball gives no light").into())
}

/// Renders frames until all shadow maps are up to date.
fn settle(app: &mut App) -> Outcome<()> {
    for _ in 0..MIN_SETTLING_FRAMES {
        headless::update(app)?;
    }
    headless::settle(app)?;
    Ok(headless::update_until(app, "drawing all shadow maps", MAX_WAIT, |app| {
        let world = app.world_mut();
        !world.query::<&DomeState>().iter(world).any(|dome| dome.outdated > 0)
    })?)
}

/// Spawns the virtual objects of a case.
fn spawn(app: &mut App, case: Case) -> Vec<Entity> {
    let mut spawned = Vec::new();
    let can = if case.blocker { VIRTUAL_CAN } else { REAL_CAN };
    if case.blocker {
        spawned.push(add(app, CAN.into(), can, Color::srgb(0.85, 0.62, 0.1)));
    }
    if case.receiver {
        let plate = Cuboid::new(0.15, 0.01, 0.13).into();
        spawned.push(add(app, plate, can + TO_PLATE, Color::srgb(0.85, 0.85, 0.85)));
    }
    if case.light {
        let lamp = SpotLight {
            color: Color::srgb(1.0, 0.8, 0.5),
            intensity: 9_000.0,
            inner_angle: 0.2,
            outer_angle: 0.36,
            shadow_maps_enabled: true,
            // Suits objects a few centimeters high.
            shadow_depth_bias: 0.002,
            ..default()
        };
        let aim = can + 0.5 * TO_PLATE;
        let transform = Transform::from_translation(aim + TO_LAMP).looking_at(aim, Vec3::Y);
        spawned.push(app.world_mut().spawn((lamp, transform)).id());
    }
    spawned
}

fn add(app: &mut App, mesh: Mesh, place: Vec3, base_color: Color) -> Entity {
    let material = StandardMaterial { base_color, perceptual_roughness: 0.8, ..default() };
    let material = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(material);
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
    app.world_mut().spawn((Mesh3d(mesh), MeshMaterial3d(material), Transform::from_translation(place))).id()
}
