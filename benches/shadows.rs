//! Dome shadows against the shadows that Bevy has: what each adds to the time of a frame, on the same scene in one process.
//!
//! `cargo bench --profile dev --features egui,webcam --bench shadows -- --csv shadows.csv`
//!
//! In the development profile, so that what `cargo test` has built is used: most of the measured work is the graphics
//! driver's. Spheres float above a plane under an environment map; they stand still (`static`) or all move in every frame
//! (`moving`). The columns are `case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device`:
//! - `ours_ms`, `peer_ms`: what the dome and the peer add to the median time of a frame without shadows, until the GPU has
//!   finished it; `ratio` = ours ÷ peer. Of the peer `none` it is the time of that frame itself;
//! - `triangles`: of all casters together, as meshes divide; `k`: shadow maps that the dome drew again in the last frame.
//!
//! Peers have Bevy's default settings: directional lights 4 cascades of 2048² texels, spot lights maps of the same size. All
//! cameras are single-sampled, as ambient occlusion in screen space demands.
//!
//! One app per peer and number of directions; blocks of frames alternate between them, forth and back. `--quick` takes few
//! frames of few cases; `--triangles 1000,200000`, `--directions 64`, `--peers none,directional_2`, `--motion static`,
//! `--size 1920x1080`, `--samples full`, `--warm-up N`, `--blocks N` and `--frames N` (in a block) choose for themselves.

#[path = "../tests/filter_truth/mod.rs"]
#[expect(dead_code, reason = "only its sources and its way to wait for the GPU are used here")]
mod filter_truth;

use bevy::{
    core_pipeline::tonemapping::Tonemapping,
    light::NotShadowCaster,
    pbr::ScreenSpaceAmbientOcclusion,
    prelude::*,
    render::{
        RenderApp,
        renderer::{RenderAdapterInfo, RenderDevice},
    },
};
use bevy_mirrorball::{
    environment::{EnvironmentPlugin, LiveEnvironment, Refresh},
    materials::MaterialsPlugin,
    offscreen,
    probe::EnvironmentCube,
    shadows::{DomeState, ShadowDomeLight, ShadowsPlugin, VisibilitySamples},
    stage::StagePlugin,
};
use std::{fmt::Write, path::PathBuf, str::FromStr, time::Instant};

const CASTERS: u32 = 16;
/// Spheres stand in a square of this many rows, this far apart and this large, in metres.
const ROWS: u32 = 4;
const GAP: f32 = 1.6;
const RADIUS: f32 = 0.5;
/// How far moving spheres swing, in metres, and the radians by which they go on in a frame.
const SWING: f32 = 0.4;
const STEP: f32 = 0.15;
const PEERS: [&str; 6] = ["none", "directional_1", "directional_2", "directional_10", "spot_64", "ssao"];

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

struct Options {
    csv: Option<PathBuf>,
    size: UVec2,
    triangles: Vec<u32>,
    directions: Vec<u32>,
    peers: Vec<String>,
    motions: Vec<String>,
    samples: VisibilitySamples,
    warm_up: usize,
    blocks: usize,
    frames: usize,
}

/// Values between commas.
fn list<T: FromStr>(text: &str) -> Result<Vec<T>, T::Err> {
    text.split(',').map(str::parse).collect()
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self {
            csv: None,
            size: UVec2::new(640, 360),
            triangles: vec![1_000, 20_000, 200_000],
            directions: vec![16, 64, 256],
            peers: PEERS.map(str::to_owned).to_vec(),
            motions: vec!["static".to_owned(), "moving".to_owned()],
            samples: VisibilitySamples::Half,
            // A dome that moves from its first frame on has drawn every direction once after so many.
            warm_up: 20,
            blocks: 4,
            frames: 6,
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("quick") => {
                    options.triangles = vec![1_000, 20_000];
                    options.directions = vec![64];
                    (options.warm_up, options.blocks, options.frames) = (5, 2, 2);
                }
                Long("size") => {
                    let text = parser.value()?.string()?;
                    let size =
                        text.split_once('x').and_then(|(x, y)| Some(UVec2::new(x.parse().ok()?, y.parse().ok()?)));
                    let size = size.filter(|size| size.min_element() > 0);
                    options.size = size.ok_or("--size: write it like 640x360")?;
                }
                Long("triangles") => options.triangles = list(&parser.value()?.string()?)?,
                Long("directions") => options.directions = list(&parser.value()?.string()?)?,
                Long("peers") => {
                    options.peers = list(&parser.value()?.string()?)?;
                    if let Some(other) = options.peers.iter().find(|peer| !PEERS.contains(&peer.as_str())) {
                        return Err(format!("--peers: there is no {other}; choose from {PEERS:?}").into());
                    }
                }
                Long("motion") => options.motions = list(&parser.value()?.string()?)?,
                Long("samples") => {
                    options.samples = match parser.value()?.string()?.as_str() {
                        "half" => VisibilitySamples::Half,
                        "full" => VisibilitySamples::Full,
                        "fragment" => VisibilitySamples::Fragment,
                        other => return Err(format!("--samples: {other} is none of half, full, fragment").into()),
                    };
                }
                Long("warm-up") => options.warm_up = parser.value()?.parse()?,
                Long("blocks") => options.blocks = parser.value()?.parse::<usize>()?.max(1),
                Long("frames") => options.frames = parser.value()?.parse::<usize>()?.max(1),
                // Cargo says so to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        // Everything is compared to a frame without shadows.
        if !options.peers.iter().any(|peer| peer == "none") {
            options.peers.insert(0, "none".to_owned());
        }
        Ok(options)
    }
}

/// What throws shadows in an app.
#[derive(Clone, Debug, PartialEq)]
enum Shadows {
    Dome(u32),
    Peer(String),
}

/// An app and the times of its frames in milliseconds.
struct Contender {
    shadows: Shadows,
    app: App,
    times: Vec<f64>,
}

/// A sphere that swings around a place.
#[derive(Component)]
struct Swings(Vec3);

fn swing(mut spheres: Query<(&Swings, &mut Transform)>, mut frame: Local<u32>) {
    *frame += 1;
    for (Swings(home), mut transform) in &mut spheres {
        let phase = STEP * *frame as f32 + home.x + 2.0 * home.z;
        transform.translation = *home + SWING * Vec3::new(phase.sin(), 0.0, phase.cos());
    }
}

/// A sphere of about so many triangles.
fn sphere(triangles: u32) -> Mesh {
    let stacks = ((triangles as f32 / 2.0).sqrt().round() as u32).max(3);
    let sectors = (triangles as f32 / (2.0 * (stacks - 1) as f32)).round().max(3.0) as u32;
    Sphere::new(RADIUS).mesh().uv(sectors, stacks)
}

fn triangles_of(mesh: &Mesh) -> usize {
    mesh.indices().map_or(0, |indices| indices.len() / 3)
}

impl Contender {
    fn new(shadows: Shadows, options: &Options, triangles: u32, is_moving: bool) -> Outcome<Self> {
        let mut app = offscreen::build_app(offscreen::default_plugins(), |app| {
            app.add_plugins((StagePlugin, EnvironmentPlugin, ShadowsPlugin, MaterialsPlugin));
            if is_moving {
                app.add_systems(Update, swing);
            }
        })?;
        let (_, target) = offscreen::add_target(&mut app, options.size);
        let world = app.world_mut();
        let texels = filter_truth::texels(EnvironmentCube::SIZE as usize, filter_truth::two_suns);
        let cube = filter_truth::cube(EnvironmentCube::SIZE as usize, &texels);
        let cube = world.resource_mut::<Assets<Image>>().add(cube);
        let mut meshes = world.resource_mut::<Assets<Mesh>>();
        let ball = meshes.add(sphere(triangles / CASTERS));
        let plane = meshes.add(Plane3d::default().mesh().size(12.0, 12.0));
        let mut materials = world.resource_mut::<Assets<StandardMaterial>>();
        let [gray, red] = [Color::srgb(0.7, 0.7, 0.7), Color::srgb(0.8, 0.3, 0.2)]
            .map(|base_color| materials.add(StandardMaterial { base_color, ..default() }));
        world.spawn((Mesh3d(plane), MeshMaterial3d(gray), NotShadowCaster));
        for i in 0..CASTERS {
            let place = Vec2::new((i % ROWS) as f32, (i / ROWS) as f32) - 0.5 * (ROWS - 1) as f32;
            let home = Vec3::new(GAP * place.x, 1.1 * RADIUS, GAP * place.y);
            let at_home = Transform::from_translation(home);
            world.spawn((Mesh3d(ball.clone()), MeshMaterial3d(red.clone()), at_home, Swings(home)));
        }
        let camera = world
            .spawn((
                Camera3d::default(),
                Msaa::Off,
                Tonemapping::None,
                AmbientLight { brightness: 0.0, ..default() },
                LiveEnvironment::new(cube.clone()).with_refresh(Refresh::OnChange),
                Transform::from_xyz(0.0, 4.5, 8.0).looking_at(Vec3::ZERO, Vec3::Y),
                target,
            ))
            .id();
        world.spawn(EnvironmentCube(cube));
        match &shadows {
            Shadows::Dome(directions) => {
                world.spawn(ShadowDomeLight { directions: *directions, samples: options.samples, ..default() });
            }
            Shadows::Peer(peer) => add_peer(world, peer, camera),
        }
        for _ in 0..options.warm_up {
            frame(&mut app);
        }
        Ok(Self { shadows, app, times: Vec::new() })
    }

    fn median(&self) -> f64 {
        let mut sorted = self.times.clone();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.len() / 2;
        if sorted.len() % 2 == 1 { sorted[middle] } else { 0.5 * (sorted[middle - 1] + sorted[middle]) }
    }

    /// Shadow maps drawn in the last frame.
    fn redrawn(&mut self) -> u32 {
        let world = self.app.world_mut();
        world.query::<&DomeState>().iter(world).next().map_or(0, |state| state.redrawn)
    }
}

/// Places on a hemisphere above the scene.
fn above(count: u32) -> impl Iterator<Item = Transform> {
    (0..count).map(move |i| {
        let height = (i as f32 + 0.5) / count as f32 * 0.8 + 0.2;
        let angle = 2.4 * i as f32;
        let around = (1.0 - height * height).sqrt();
        let from = 9.0 * Vec3::new(around * angle.cos(), height, around * angle.sin());
        Transform::from_translation(from).looking_at(Vec3::ZERO, Vec3::X)
    })
}

fn add_peer(world: &mut World, peer: &str, camera: Entity) {
    if let Some(count) = peer.strip_prefix("directional_").and_then(|count| count.parse().ok()) {
        for transform in above(count) {
            let illuminance = 3_000.0 / count as f32;
            world.spawn((DirectionalLight { illuminance, shadow_maps_enabled: true, ..default() }, transform));
        }
    } else if let Some(count) = peer.strip_prefix("spot_").and_then(|count| count.parse().ok()) {
        for transform in above(count) {
            let lamp = SpotLight {
                intensity: 3e6 / count as f32,
                range: 30.0,
                // Around all spheres.
                outer_angle: 0.45,
                shadow_maps_enabled: true,
                ..default()
            };
            world.spawn((lamp, transform));
        }
    } else if peer == "ssao" {
        world.entity_mut(camera).insert(ScreenSpaceAmbientOcclusion::default());
    }
}

/// One frame, until the GPU has finished it; in milliseconds.
fn frame(app: &mut App) -> f64 {
    let started = Instant::now();
    app.update();
    filter_truth::wait(app.sub_app(RenderApp).world().resource::<RenderDevice>());
    started.elapsed().as_secs_f64() * 1e3
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut csv = "case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device\n".to_owned();
    for motion in &options.motions {
        for &triangles in &options.triangles {
            measure(&options, motion, triangles, &mut csv)?;
            // What was measured stays when a long run is cut off.
            if let Some(path) = &options.csv {
                std::fs::write(path, &csv)?;
            }
        }
    }
    if options.csv.is_none() {
        print!("{csv}");
    }
    Ok(())
}

fn measure(options: &Options, motion: &str, triangles: u32, csv: &mut String) -> Outcome<()> {
    let is_moving = motion == "moving";
    let peers = options.peers.iter().cloned().map(Shadows::Peer);
    let domes = options.directions.iter().copied().map(Shadows::Dome);
    let mut contenders = Vec::new();
    for shadows in peers.chain(domes) {
        contenders.push(Contender::new(shadows, options, triangles, is_moving)?);
    }
    for block in 0..options.blocks {
        let mut order: Vec<_> = (0..contenders.len()).collect();
        // Forth and back: none always runs on the warmer machine.
        if block % 2 == 1 {
            order.reverse();
        }
        for i in order {
            let Contender { app, times, .. } = &mut contenders[i];
            times.extend((0..options.frames).map(|_| frame(app)));
        }
    }
    let drawn = CASTERS as usize * triangles_of(&sphere(triangles / CASTERS));
    let base = contenders.iter().find(|other| other.shadows == Shadows::Peer("none".to_owned()));
    let base = base.ok_or("there is no frame without shadows")?.median();
    let device = contenders[0].app.sub_app(RenderApp).world().resource::<RenderAdapterInfo>().name.replace(',', ";");
    println!("{motion}, {drawn} triangles, on {device}: a frame takes {base:.1} ms without shadows");
    let mut peers = Vec::new();
    for contender in &mut contenders {
        let added = contender.median() - base;
        match contender.shadows.clone() {
            Shadows::Peer(peer) if peer == "none" => peers.push((peer, base)),
            Shadows::Peer(peer) => {
                println!("  {peer} adds {added:.1} ms");
                peers.push((peer, added));
            }
            Shadows::Dome(directions) => {
                let k = contender.redrawn();
                println!("  {directions} directions add {added:.1} ms, {k} of them redrawn");
                for (peer, peer_ms) in &peers {
                    writeln!(
                        csv,
                        "spheres_{motion},{directions},{CASTERS},{drawn},{},{},{k},{added:.3},{peer},{peer_ms:.3},{:.3},{device}",
                        options.size.x,
                        options.size.y,
                        added / peer_ms
                    )?;
                }
            }
        }
    }
    Ok(())
}
