//! Time of a frame with each surface style, relative to the same frame with the engine's `StandardMaterial` under the
//! same static environment map and the same shadow dome.
//!
//! `cargo bench --profile dev --features egui,webcam --bench looks -- --csv looks.csv`
//!
//! It runs in the development profile, so that the build of `cargo test` is reused: nearly all measured work is done by
//! the graphics driver. Spheres before a wall fill the picture, in blocks that alternate in one process. The columns
//! are `style,ours_ms,engine_ms,ratio`; `--blocks N` is the number of blocks. The last line is about 500 spheres that
//! all change their style in one frame: the longest of the frames that follow, and a frame without changes. Much of
//! that is the engine's work in this profile.

mod support;

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight},
    prelude::*,
};
use bevy_mirrorball::{
    headless, materials::MaterialsPlugin, phantom::PhantomPlugin, prelude::*, shadows::ShadowsPlugin,
};
use std::{fmt::Write, path::PathBuf};
use support::{Outcome, alternate, frame_time, gray_sky, median, save};

/// Size of the picture in pixels: for the styles, and for changes of many at once, which cost the processor's time.
const SIZE: UVec2 = UVec2::new(640, 480);
const SMALL: UVec2 = UVec2::new(64, 48);
/// Number of frames in a block, and before the first.
const BLOCK: usize = 4;
const WARM_UP: usize = 6;
/// Columns and rows of spheres: for the styles, and for changes of many at once.
const FEW: UVec2 = UVec2::new(5, 3);
const MANY: UVec2 = UVec2::new(25, 20);

struct Options {
    csv: Option<PathBuf>,
    blocks: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, blocks: 10 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
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
struct Gallery {
    app: App,
    spheres: Vec<Entity>,
}

impl Gallery {
    fn new(style: SurfaceStyle, grid: UVec2, size: UVec2) -> Outcome<Self> {
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
        })?;
        let (_, target) = headless::add_target(&mut app, size);
        let world = app.world_mut();
        world.insert_resource(GlobalAmbientLight::NONE);
        world.spawn(ShadowDomeLight::default());
        let map = gray_sky(&mut world.resource_mut::<Assets<Image>>());
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
        let spacing = 3.0 / grid.x as f32;
        let sphere = |i| {
            let across = UVec2::new(i % grid.x, i / grid.x).as_vec2() - 0.5 * (grid - 1).as_vec2();
            let place = Transform::from_translation((spacing * across).extend(0.0));
            let place = place.with_scale(Vec3::splat(spacing * FEW.x as f32 / 3.0));
            world.spawn((ChildOf(root), Mesh3d(ball.clone()), MeshMaterial3d(paint.clone()), place)).id()
        };
        let spheres = (0..grid.element_product()).map(sphere).collect();
        headless::settle(&mut app)?;
        (0..WARM_UP).try_for_each(|_| frame_time(&mut app).map(drop))?;
        Ok(Self { app, spheres })
    }
}

/// Longest frame in ms after all of many spheres changed their style in one frame, and a frame in which none does.
fn change_of_many() -> Outcome<[f64; 2]> {
    let mut gallery = Gallery::new(SurfaceStyle::ImageBased, MANY, SMALL)?;
    let round = [SurfaceStyle::Toon(default()), SurfaceStyle::Classic(default()), SurfaceStyle::ImageBased];
    let (mut after, mut steady) = (Vec::new(), Vec::new());
    for i in 0..4 {
        for style in round {
            for sphere in &gallery.spheres {
                gallery.app.world_mut().entity_mut(*sphere).insert(style);
            }
            let times = (0..2 * BLOCK).map(|_| frame_time(&mut gallery.app)).collect::<Outcome<Vec<_>>>()?;
            // In the first round shaders are compiled.
            if i > 0 {
                after.extend(&times[..BLOCK]);
                steady.extend(&times[BLOCK..]);
            }
        }
    }
    Ok([after.into_iter().fold(0.0, f64::max), median(&steady)])
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let engine = ("engine", SurfaceStyle::Engine);
    let mut galleries = std::iter::once(engine)
        .chain(styles())
        .map(|(name, style)| Ok((name, Gallery::new(style, FEW, SIZE)?, Vec::new())))
        .collect::<Outcome<Vec<_>>>()?;
    alternate(&mut galleries, options.blocks, |(_, gallery, times)| {
        for _ in 0..BLOCK {
            times.push(frame_time(&mut gallery.app)?);
        }
        Ok(())
    })?;
    let mut csv = "style,ours_ms,engine_ms,ratio\n".to_owned();
    let engine_ms = median(&galleries[0].2);
    for (name, _, times) in &galleries[1..] {
        let ours_ms = median(times);
        let ratio = ours_ms / engine_ms;
        println!("{name}: {ours_ms:.1} ms, engine {engine_ms:.1} ms, ratio {ratio:.3}");
        writeln!(csv, "{name},{ours_ms:.3},{engine_ms:.3},{ratio:.4}")?;
    }
    let [longest_ms, steady_ms] = change_of_many()?;
    let (count, ratio) = (MANY.element_product(), longest_ms / steady_ms);
    println!("{count} change: longest frame {longest_ms:.1} ms, others {steady_ms:.1} ms, ratio {ratio:.3}");
    writeln!(csv, "{count} change,{longest_ms:.3},{steady_ms:.3},{ratio:.4}")?;
    save(&csv, options.csv)
}
