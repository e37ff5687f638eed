//! Spheres of different roughness, lit by an animated sky, without marker, ball or camera.
//!
//! `cargo run --example live_environment`, or without a window
//! `cargo run --example live_environment -- --headless --frames 8 --out sky`.

use bevy::{
    app::AppExit,
    asset::RenderAssetUsages,
    core_pipeline::tonemapping::Tonemapping,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{
    environment_map::equirect_direction,
    headless,
    prefilter::{LiveEnvironment, PrefilterPlugin, Refresh},
};
use std::path::PathBuf;

/// Width of the sky's equirectangular image in pixels.
const SKY_WIDTH: u32 = 128;
const PICTURE: UVec2 = UVec2::new(480, 240);
/// Seconds from one sunrise to the next, and between two headless images.
const DAY: f32 = 16.0;
const HEADLESS_STEP: f32 = 1.0;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// The image of the sky, and its time in seconds.
#[derive(Resource)]
struct Sky {
    picture: Handle<Image>,
    time: f32,
}

fn main() -> Outcome<AppExit> {
    use lexopt::prelude::*;
    let (mut is_headless, mut frames, mut out) = (false, 8, PathBuf::from("live_environment"));
    let mut parser = lexopt::Parser::from_env();
    while let Some(argument) = parser.next()? {
        match argument {
            Long("headless") => is_headless = true,
            Long("frames") => frames = parser.value()?.parse()?,
            Long("out") => out = parser.value()?.into(),
            other => return Err(other.unexpected().into()),
        }
    }
    if is_headless {
        draw_to_files(frames, &out)?;
        return Ok(AppExit::Success);
    }
    let mut app = App::new();
    app.add_plugins(DefaultPlugins);
    add_scene(&mut app);
    let camera = camera(app.world());
    app.world_mut().spawn(camera);
    let advance = |time: Res<Time>, mut sky: ResMut<Sky>| sky.time = time.elapsed_secs();
    app.add_systems(Update, advance.before(paint_sky));
    Ok(app.run())
}

fn draw_to_files(frames: u32, out: &std::path::Path) -> Outcome<()> {
    std::fs::create_dir_all(out)?;
    let mut app = headless::build_app(headless::default_plugins(), add_scene)?;
    let (picture, target) = headless::add_target(&mut app, PICTURE);
    let camera = camera(app.world());
    app.world_mut().spawn((camera, target));
    headless::settle(&mut app)?;
    for frame in 0..frames {
        app.world_mut().resource_mut::<Sky>().time = frame as f32 * HEADLESS_STEP;
        // One frame each until the sky has reached the renderer, its cube and the light.
        for _ in 0..3 {
            headless::update(&mut app)?;
        }
        let bytes = headless::read_texture(&mut app, &picture)?;
        let file = out.join(format!("frame_{frame:04}.png"));
        image::save_buffer(&file, &bytes, PICTURE.x, PICTURE.y, image::ExtendedColorType::Rgba8)?;
    }
    println!("live_environment: {frames} pictures in {}", out.display());
    Ok(())
}

fn camera(world: &World) -> impl Bundle + use<> {
    let sky = world.resource::<Sky>().picture.clone();
    (
        Camera3d::default(),
        Tonemapping::None,
        Transform::from_xyz(0.0, 0.9, 4.4).looking_at(Vec3::new(0.0, 0.2, 0.0), Vec3::Y),
        AmbientLight { brightness: 0.0, ..default() },
        LiveEnvironment::new(sky).with_refresh(Refresh::OnChange),
    )
}

/// Adds two rows of spheres, smooth to rough from left to right: metal in the back row, plastic in front.
fn add_scene(app: &mut App) {
    // Approximately the color of the air at the horizon.
    let air = ClearColor(Color::linear_rgb(0.35, 0.5, 0.8));
    app.add_plugins(PrefilterPlugin).insert_resource(air).add_systems(Update, paint_sky);
    let world = app.world_mut();
    let extent = Extent3d { width: SKY_WIDTH, height: SKY_WIDTH / 2, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba32Float;
    let picture = Image::new_fill(extent, TextureDimension::D2, &[0; 16], format, RenderAssetUsages::all());
    let picture = world.resource_mut::<Assets<Image>>().add(picture);
    world.insert_resource(Sky { picture, time: 0.0 });
    let ball = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.45));
    for i in 0..10 {
        let (column, is_metal) = (i % 5, i < 5);
        let material = StandardMaterial {
            base_color: if is_metal { Color::srgb(1.0, 0.86, 0.57) } else { Color::srgb(0.7, 0.12, 0.1) },
            metallic: if is_metal { 1.0 } else { 0.0 },
            perceptual_roughness: (column as f32 / 4.0).max(0.05),
            ..default()
        };
        let material = world.resource_mut::<Assets<StandardMaterial>>().add(material);
        let (y, z) = if is_metal { (0.75, -0.5) } else { (-0.3, 0.5) };
        let place = Transform::from_xyz(column as f32 - 2.0, y, z);
        world.spawn((Mesh3d(ball.clone()), MeshMaterial3d(material), place));
    }
}

/// Paints a sky with a circling sun. The lighting follows because the image changes.
fn paint_sky(sky: Res<Sky>, mut images: ResMut<Assets<Image>>) {
    if !sky.is_changed() {
        return;
    }
    let angle = std::f32::consts::TAU * sky.time / DAY + 0.4;
    let sun = Vec3::new(angle.cos(), 0.6, angle.sin()).normalize();
    let size = Vec2::new(SKY_WIDTH as f32, SKY_WIDTH as f32 / 2.0);
    let Some(mut picture) = images.get_mut(&sky.picture) else {
        return;
    };
    let radiance = |i: u32| {
        let dir = equirect_direction((Vec2::new((i % SKY_WIDTH) as f32, (i / SKY_WIDTH) as f32) + 0.5) / size);
        let air = if dir.y > 0.0 {
            Vec3::new(0.55, 0.7, 0.9).lerp(Vec3::new(0.12, 0.3, 0.75), dir.y.sqrt())
        } else {
            Vec3::new(0.16, 0.14, 0.12)
        };
        let glow = dir.dot(sun).max(0.0);
        air + Vec3::new(1.0, 0.8, 0.5) * (0.4 * glow.powi(8) + 60.0 * glow.powi(1500))
    };
    let bytes = (0..SKY_WIDTH * SKY_WIDTH / 2)
        .map(radiance)
        .flat_map(|light| [light.x, light.y, light.z, 1.0].into_iter().flat_map(f32::to_le_bytes));
    picture.data = Some(bytes.collect());
}
