//! Time of a frame with each surface style, relative to the same frame with the engine's `StandardMaterial` under the
//! same static environment map and the same shadow dome.
//!
//! `cargo bench --profile dev --features egui,webcam --bench looks -- --csv looks.csv`
//!
//! It runs in the development profile, so that the build of `cargo test` is reused: all measured work is done by the
//! graphics driver. Spheres before a wall fill the picture, in blocks that alternate in one process. The columns are
//! `style,ours_ms,engine_ms,ratio`. `--size 640x480` is the size of the picture, `--blocks N` the number of blocks.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight},
    prelude::*,
    render::{
        RenderApp,
        render_resource::{PollType, TextureUsages},
        renderer::RenderDevice,
    },
};
use bevy_mirrorball::{
    environment_map::CubePixels, headless, materials::MaterialsPlugin, phantom::PhantomPlugin, prelude::*,
    shadows::ShadowsPlugin,
};
use std::{fmt::Write, path::PathBuf, time::Instant};

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

/// Number of frames in a block, and before the first.
const BLOCK: usize = 4;
const WARM_UP: usize = 6;

struct Options {
    csv: Option<PathBuf>,
    size: UVec2,
    blocks: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, size: UVec2::new(640, 480), blocks: 10 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("size") => {
                    let text = parser.value()?.string()?;
                    let (width, height) = text.split_once('x').ok_or("--size: write it as 640x480")?;
                    options.size = UVec2::new(width.parse()?, height.parse()?).max(UVec2::ONE);
                }
                Long("blocks") => options.blocks = parser.value()?.parse::<usize>()?.max(1),
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// Styles by name.
fn styles() -> Vec<(&'static str, SurfaceStyle)> {
    let toon = |outline_width| SurfaceStyle::Toon(ToonStyle { outline_width, ..default() });
    vec![
        ("image-based", SurfaceStyle::ImageBased),
        ("toon", toon(2.0)),
        ("toon without outline", toon(0.0)),
        ("classic", SurfaceStyle::Classic(default())),
    ]
}

/// Spheres before a wall, in one style.
struct Gallery(App);

impl Gallery {
    fn new(style: SurfaceStyle, size: UVec2) -> Outcome<Self> {
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
        })?;
        let (_, target) = headless::add_target(&mut app, size);
        let world = app.world_mut();
        world.insert_resource(GlobalAmbientLight::NONE);
        world.spawn(ShadowDomeLight::default());
        // A gray sky that is brighter overhead, as a file would give it: nothing on the GPU writes it.
        let sky = |i: u32| Vec3::splat(if i / 256 == 2 { 1.0 } else { 0.4 });
        let mut map = CubePixels { edge: 16, texels: (0..6 * 256).map(sky).collect() }.to_image();
        map.texture_descriptor.usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        let map = world.resource_mut::<Assets<Image>>().add(map);
        world.spawn((
            Camera3d::default(),
            Transform::from_xyz(0.0, 0.0, 2.4),
            EnvironmentMapLight {
                diffuse_map: map.clone(),
                specular_map: map,
                intensity: 1.0 / Exposure::default().exposure(),
                ..default()
            },
            (target, Msaa::Off, Tonemapping::None, DebandDither::Disabled),
        ));
        let paint = StandardMaterial { base_color: Color::srgb(0.8, 0.5, 0.4), perceptual_roughness: 0.4, ..default() };
        let paint = world.resource_mut::<Assets<StandardMaterial>>().add(paint);
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let (ball, wall) = (meshes.add(Sphere::new(0.28)), meshes.add(Plane3d::new(Vec3::Z, Vec2::splat(3.0))));
        let root = world.spawn((style, Transform::default(), Visibility::default())).id();
        world.spawn((ChildOf(root), Mesh3d(wall), MeshMaterial3d(paint.clone()), Transform::from_xyz(0.0, 0.0, -0.3)));
        for i in 0..15 {
            let place = 0.6 * Vec3::new((i % 5) as f32 - 2.0, (i / 5) as f32 - 1.0, 0.0);
            let place = Transform::from_translation(place);
            world.spawn((ChildOf(root), Mesh3d(ball.clone()), MeshMaterial3d(paint.clone()), place));
        }
        headless::settle(&mut app)?;
        let mut gallery = Self(app);
        (0..WARM_UP).try_for_each(|_| gallery.frame().map(drop))?;
        Ok(gallery)
    }

    /// Renders one frame and returns the time until the GPU has finished it, in milliseconds.
    fn frame(&mut self) -> Outcome<f64> {
        let started = Instant::now();
        headless::update(&mut self.0)?;
        // A lost device does not respond; the next frame reports it.
        let _ = self.0.sub_app(RenderApp).world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
        Ok(started.elapsed().as_secs_f64() * 1e3)
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let engine = ("engine", SurfaceStyle::Engine);
    let mut galleries = std::iter::once(engine)
        .chain(styles())
        .map(|(name, style)| Ok((name, Gallery::new(style, options.size)?, Vec::new())))
        .collect::<Outcome<Vec<_>>>()?;
    for block in 0..options.blocks {
        let count = galleries.len();
        for i in 0..count {
            // In alternating order, so that no style always runs on the warmer machine.
            let (_, gallery, times) = &mut galleries[if block % 2 == 0 { i } else { count - 1 - i }];
            for _ in 0..BLOCK {
                times.push(gallery.frame()?);
            }
        }
    }
    let mut csv = "style,ours_ms,engine_ms,ratio\n".to_owned();
    let engine_ms = median(&mut galleries[0].2);
    for (name, _, times) in &mut galleries[1..] {
        let ours_ms = median(times);
        let ratio = ours_ms / engine_ms;
        println!("{name}: {ours_ms:.1} ms, engine {engine_ms:.1} ms, ratio {ratio:.3}");
        writeln!(csv, "{name},{ours_ms:.3},{engine_ms:.3},{ratio:.4}")?;
    }
    match options.csv {
        Some(path) => {
            std::fs::write(&path, csv).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
        }
        None => print!("{csv}"),
    }
    Ok(())
}
