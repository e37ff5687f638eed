//! Added frame time of a shadow dome against what the engine offers, on the same scene in one process.
//!
//! `cargo bench --profile dev --features egui,webcam --bench shadows -- --csv shadows.csv`
//!
//! In the development profile, so that what `cargo test` has built is used: all measured work is the graphics driver's.
//! The columns are `case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device`. Times are what
//! a frame takes longer than the same frame without shadows (medians of alternating blocks), ratio = ours ÷ peer; rows
//! with peer `none` have whole frames instead. A case is `static` or `moving` (every caster turns in every frame), with
//! what `VisibilitySamples` are used, and `k` is the number of directions drawn again per moving frame.
//!
//! `--triangles 1000,20000,200000` and `--directions 16,64,256` choose what is measured, `--size 640x360` the picture,
//! `--blocks N` how often blocks alternate, `--peers directional_2,ssao` the peers, `--samples interleaved,half` what
//! is summed up where, `--key-lights N` how many places for key lights the dome has, all of them free.

use bevy::{
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GlobalAmbientLight, NotShadowCaster},
    pbr::ScreenSpaceAmbientOcclusion,
    prelude::*,
    render::{
        RenderApp,
        render_resource::PollType,
        renderer::{RenderAdapterInfo, RenderDevice},
    },
};
use bevy_mirrorball::{
    environment_map::CubePixels,
    materials::MaterialsPlugin,
    offscreen,
    phantom::PhantomPlugin,
    prelude::*,
    shadows::{ShadowsPlugin, VisibilitySamples},
};
use std::{collections::BTreeMap, fmt::Write, path::PathBuf, str::FromStr, time::Instant};

/// Frames before anything counts, and frames in a block.
const WARM_UP: usize = 5;
const BLOCK: usize = 3;
const CASTERS: u32 = 20;
/// Directions drawn again in a moving frame.
const REFRESHED: u32 = 16;

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Samples {
    Interleaved,
    Half,
    Full,
}

impl Samples {
    fn name(self) -> &'static str {
        match self {
            Self::Interleaved => "interleaved",
            Self::Half => "half",
            Self::Full => "full",
        }
    }

    fn of_dome(self) -> VisibilitySamples {
        match self {
            Self::Interleaved => VisibilitySamples::Interleaved,
            Self::Half => VisibilitySamples::Half,
            Self::Full => VisibilitySamples::Full,
        }
    }
}

impl FromStr for Samples {
    type Err = std::io::Error;

    fn from_str(name: &str) -> Result<Self, Self::Err> {
        let all = [Self::Interleaved, Self::Half, Self::Full];
        all.into_iter()
            .find(|samples| samples.name() == name)
            .ok_or_else(|| std::io::Error::other(format!("--samples: {name} is none of interleaved, half, full")))
    }
}

/// What throws the shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Method {
    None,
    Dome(u32, Samples),
    Directional(u32),
    Spot(u32),
    Ssao,
}

impl Method {
    const PEERS: [Self; 6] =
        [Self::None, Self::Directional(1), Self::Directional(2), Self::Directional(10), Self::Spot(64), Self::Ssao];

    fn name(self) -> String {
        match self {
            Self::None => "none".into(),
            Self::Dome(directions, samples) => format!("dome_{directions}_{}", samples.name()),
            Self::Directional(count) => format!("directional_{count}"),
            Self::Spot(count) => format!("spot_{count}"),
            Self::Ssao => "ssao".into(),
        }
    }
}

struct Options {
    csv: Option<PathBuf>,
    triangles: Vec<u32>,
    directions: Vec<u32>,
    samples: Vec<Samples>,
    key_lights: u32,
    peers: Vec<Method>,
    size: UVec2,
    blocks: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self {
            csv: None,
            triangles: vec![1_000, 20_000, 200_000],
            directions: vec![16, 64, 256],
            samples: vec![Samples::Interleaved, Samples::Half],
            key_lights: 0,
            peers: Method::PEERS.to_vec(),
            size: UVec2::new(640, 360),
            blocks: 1,
        };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("triangles") => options.triangles = list(&parser.value()?.string()?)?,
                Long("directions") => options.directions = list(&parser.value()?.string()?)?,
                Long("samples") => options.samples = list(&parser.value()?.string()?)?,
                Long("key-lights") => options.key_lights = parser.value()?.parse()?,
                Long("peers") => {
                    let names = parser.value()?.string()?;
                    let wanted =
                        |peer: &Method| *peer == Method::None || names.split(',').any(|name| name == peer.name());
                    options.peers.retain(wanted);
                }
                Long("size") => {
                    let size = parser.value()?.string()?;
                    let (width, height) = size.split_once('x').ok_or("--size: write it as 640x360")?;
                    options.size = UVec2::new(width.parse()?, height.parse()?);
                }
                Long("blocks") => options.blocks = parser.value()?.parse::<usize>()?.max(1),
                // Cargo says so to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

fn list<T: FromStr<Err: std::error::Error + 'static>>(text: &str) -> Outcome<Vec<T>> {
    Ok(text.split(',').map(str::parse).collect::<Result<_, _>>()?)
}

/// A ball of about this many triangles.
fn ball(triangles: u32) -> Mesh {
    let sectors = (triangles as f32).sqrt().round().max(4.0) as u32;
    Sphere::new(0.15).mesh().uv(sectors, (triangles / (2 * sectors)).max(2) + 1)
}

/// The scene in which one method throws the shadows.
struct Stage {
    app: App,
    casters: Vec<Entity>,
    triangles: usize,
    turned: f32,
}

impl Stage {
    fn new(method: Method, triangles: u32, options: &Options) -> Outcome<Self> {
        let mut app = offscreen::build_app(offscreen::default_plugins(), |app| {
            app.add_plugins((PhantomPlugin, ShadowsPlugin, MaterialsPlugin));
        })?;
        let (_, target) = offscreen::add_target(&mut app, options.size);
        let world = app.world_mut();
        world.insert_resource(GlobalAmbientLight::NONE);
        // A gray sky that is brighter overhead.
        let sky = |i: u32| Vec3::splat(if i / 256 == 2 { 1.0 } else { 0.4 });
        let cube = CubePixels { edge: 16, texels: (0..6 * 256).map(sky).collect() };
        let map = world.resource_mut::<Assets<Image>>().add(cube.to_image());
        let camera = world
            .spawn((
                Camera3d::default(),
                Transform::from_xyz(0.0, 2.2, 3.0).looking_at(Vec3::new(0.0, 0.2, 0.0), Vec3::Y),
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
        let ground = world.resource_mut::<Assets<Mesh>>().add(Plane3d::default().mesh().size(6.0, 6.0));
        world.spawn((Mesh3d(ground), MeshMaterial3d(white.clone()), NotShadowCaster));
        let mesh = ball(triangles / CASTERS);
        let triangles = CASTERS as usize * mesh.indices().map_or(0, |indices| indices.len() / 3);
        let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
        let casters = (0..CASTERS).map(|i| {
            let place = Vec3::new(0.5 * (i % 5) as f32 - 1.0, 0.15 + 0.1 * (i % 3) as f32, 0.5 * (i / 5) as f32 - 0.75);
            world.spawn((Mesh3d(mesh.clone()), MeshMaterial3d(white.clone()), Transform::from_translation(place))).id()
        });
        let casters = casters.collect();
        let towards = |i: u32| Vec3::new((i as f32 * 2.4).cos(), 1.0 + 0.05 * i as f32, (i as f32 * 2.4).sin());
        match method {
            Method::None => (),
            Method::Dome(directions, samples) => {
                world.spawn(ShadowDomeLight {
                    directions,
                    samples: samples.of_dome(),
                    key_lights: options.key_lights,
                    refreshed_per_frame: REFRESHED,
                    ..default()
                });
            }
            Method::Directional(count) => {
                for i in 0..count {
                    let light = DirectionalLight { illuminance: 100.0, shadow_maps_enabled: true, ..default() };
                    world.spawn((light, Transform::from_translation(towards(i)).looking_at(Vec3::ZERO, Vec3::Y)));
                }
            }
            Method::Spot(count) => {
                for i in 0..count {
                    let light = SpotLight {
                        intensity: 1e5,
                        range: 30.0,
                        outer_angle: 0.3,
                        shadow_maps_enabled: true,
                        ..default()
                    };
                    let place = 8.0 * towards(i).normalize();
                    world.spawn((light, Transform::from_translation(place).looking_at(Vec3::ZERO, Vec3::Y)));
                }
            }
            Method::Ssao => {
                world.entity_mut(camera).insert(ScreenSpaceAmbientOcclusion::default());
            }
        }
        let mut stage = Self { app, casters, triangles, turned: 0.0 };
        (0..WARM_UP).for_each(|_| {
            stage.frame(true);
        });
        Ok(stage)
    }

    /// One frame, until the GPU has finished it; in milliseconds.
    fn frame(&mut self, is_moving: bool) -> f64 {
        if is_moving {
            self.turned += 0.05;
            for caster in &self.casters {
                if let Some(mut transform) = self.app.world_mut().get_mut::<Transform>(*caster) {
                    transform.rotation = Quat::from_rotation_y(self.turned);
                }
            }
        }
        let started = Instant::now();
        self.app.update();
        // A device that is lost answers nothing, and the next frame says so.
        let _ = self.app.sub_app(RenderApp).world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
        started.elapsed().as_secs_f64() * 1e3
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let UVec2 { x: width, y: height } = options.size;
    let mut csv = "case,directions,casters,triangles,width,height,k,ours_ms,peer,peer_ms,ratio,device\n".to_owned();
    for triangles in &options.triangles {
        let domes: Vec<(u32, Samples)> = options
            .directions
            .iter()
            .flat_map(|directions| options.samples.iter().map(|samples| (*directions, *samples)))
            .collect();
        let ours = domes.iter().map(|(directions, samples)| Method::Dome(*directions, *samples));
        let methods: Vec<Method> = options.peers.iter().copied().chain(ours).collect();
        let mut times: BTreeMap<(bool, Method), Vec<f64>> = BTreeMap::new();
        let mut stages = Vec::new();
        for method in &methods {
            stages.push((*method, Stage::new(*method, *triangles, &options)?));
        }
        for block in 0..2 * options.blocks {
            for is_moving in [false, true] {
                // Forth and back, so that none always runs on the warmer machine.
                let order: Vec<usize> =
                    if block % 2 == 0 { (0..stages.len()).collect() } else { (0..stages.len()).rev().collect() };
                for i in order {
                    let (method, stage) = &mut stages[i];
                    // The last shadow maps of what has moved, before a block in which nothing moves.
                    (0..if is_moving { 0 } else { 256 / REFRESHED as usize + 1 }).for_each(|_| {
                        if matches!(method, Method::Dome(..)) {
                            stage.frame(false);
                        }
                    });
                    let measured = (0..BLOCK).map(|_| stage.frame(is_moving));
                    times.entry((is_moving, *method)).or_default().extend(measured);
                }
            }
        }
        let device = stages.first().map_or(String::new(), |(_, stage)| {
            stage.app.sub_app(RenderApp).world().resource::<RenderAdapterInfo>().name.replace(',', ";")
        });
        let triangles = stages.first().map_or(0, |(_, stage)| stage.triangles);
        let medians: BTreeMap<_, f64> = times.into_iter().map(|(key, values)| (key, median(values))).collect();
        for is_moving in [false, true] {
            let (case, k) = if is_moving { ("moving", REFRESHED) } else { ("static", 0) };
            let none = medians[&(is_moving, Method::None)];
            for (directions, samples) in &domes {
                let whole = medians[&(is_moving, Method::Dome(*directions, *samples))];
                let case = format!("{case}_{}", samples.name());
                for peer in &options.peers {
                    let (ours, theirs) = match peer {
                        Method::None => (whole, none),
                        peer => (whole - none, medians[&(is_moving, *peer)] - none),
                    };
                    let (peer, ratio) = (peer.name(), ours / theirs);
                    println!(
                        "{case}, {triangles} triangles: dome of {directions} {ours:.1} ms, {peer} {theirs:.1} ms, \
                         ratio {ratio:.3}"
                    );
                    writeln!(
                        csv,
                        "{case},{directions},{CASTERS},{triangles},{width},{height},{k},{ours:.3},{peer},\
                         {theirs:.3},{ratio:.4},{device}"
                    )?;
                }
            }
        }
    }
    match options.csv {
        Some(path) => std::fs::write(path, csv)?,
        None => print!("{csv}"),
    }
    Ok(())
}
