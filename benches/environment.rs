//! Benchmark of live environments against Bevy's `GeneratedEnvironmentMapLight`: time and error, on the same sources in
//! one process.
//!
//! `cargo bench --profile dev --features egui,webcam --bench environment -- --csv environment.csv`
//!
//! It runs in the development profile, so that the build of `cargo test` is reused: all measured work is done by the
//! graphics driver. The columns are `map,size,mip,ours_ms,bevy_ms,ratio,ours_rmse,bevy_rmse,ours_seam,bevy_seam`.
//!
//! Rows with mip `all` have times: how much longer a frame without cameras takes than one in which nothing is filtered
//! (ratio = Bevy ÷ ours), measured in alternating blocks. In the row with map `picture`, ours is the whole path from a
//! camera's frame to the filtered maps, compared with Bevy's generator at 256².
//!
//! The other rows have errors, of the diffuse map and by perceptual roughness: the error relative to the sum that each
//! filter approximates, and the steps across cube edges relative to the true ones there.
//!
//! `--directions N` compares at 6·N² directions (defaults to 16; 0 leaves the errors out), `--blocks N` measures that
//! many pairs of blocks (0: none).

#[path = "../tests/environment/filter_truth.rs"]
mod filter_truth;
#[path = "../tests/support/radiance_cube.rs"]
mod radiance_cube;
#[path = "../tests/support/shared_data.rs"]
mod shared_data;

use bevy::{
    light::{EnvironmentMapLight, GeneratedEnvironmentMapLight},
    math::DVec3,
    prelude::*,
    render::{RenderApp, renderer::RenderDevice},
};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    headless,
    phantom::PhantomPlugin,
    prefilter::{LiveEnvironment, PrefilterPlugin, Refresh, SpecularLobe},
    prelude::{ArCamera, CameraFeed, FeedPace, Intrinsics, LightProbeSphere},
    probe::ProbePlugin,
    unwrap::UnwrapPlugin,
};
use filter_truth::{ROUGHNESSES, Truth, brightest, relative_rmse, seam};
use std::{fmt::Write, path::PathBuf, sync::Arc, time::Instant};

const SIZES: [usize; 2] = [128, 256];
/// Number of frames before the measurement, and in a block.
const WARM_UP: usize = 6;
const BLOCK: usize = 6;
/// Measured rooms, used if their files exist.
const ROOMS: [(&str, &str); 6] = [
    ("lebombo", "lebombo_1k.hdr"),
    ("studio_small_03", "studio_small_03_1k.hdr"),
    ("venice_sunset", "venice_sunset_1k.hdr"),
    ("empty_warehouse_01", "empty_warehouse_01_1k.hdr"),
    ("potsdamer_platz", "potsdamer_platz_1k.hdr"),
    ("night", "night.exr"),
];

type Outcome<T> = Result<T, Box<dyn std::error::Error>>;
type Radiance = Box<dyn Fn(DVec3) -> DVec3>;

struct Options {
    csv: Option<PathBuf>,
    directions: usize,
    blocks: usize,
}

impl Options {
    fn from_command_line() -> Outcome<Self> {
        use lexopt::prelude::*;
        let mut options = Self { csv: None, directions: 16, blocks: 3 };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("csv") => options.csv = Some(parser.value()?.into()),
                Long("directions") => options.directions = parser.value()?.parse()?,
                Long("blocks") => options.blocks = parser.value()?.parse()?,
                // Cargo passes this to every benchmark.
                Long("bench") => (),
                other => return Err(other.unexpected().into()),
            }
        }
        Ok(options)
    }
}

/// Builds an app without cameras in which `light` makes Bevy or this crate filter the cube in every frame.
fn app<B: Bundle>(edge: usize, texels: &[DVec3], light: impl FnOnce(Handle<Image>) -> B) -> Outcome<(App, Entity)> {
    let mut app = headless::build_app(headless::default_plugins(), |app| {
        app.add_plugins(PrefilterPlugin);
    })?;
    let source = app.world_mut().resource_mut::<Assets<Image>>().add(radiance_cube::cube_image(edge, texels));
    let entity = app.world_mut().spawn((LightProbe::default(), Transform::default(), light(source))).id();
    for _ in 0..WARM_UP {
        frame(&mut app);
    }
    Ok((app, entity))
}

/// The whole path from frame to cube to filtered maps: every update brings a new 640 × 480 frame of a ball 100 pixels
/// wide.
struct WholePath {
    app: App,
    camera: Entity,
    pictures: [Arc<FramePixels>; 2],
}

impl WholePath {
    fn new() -> Outcome<Self> {
        let mut app = headless::build_app(headless::default_plugins(), |app| {
            app.add_plugins((CameraPlugin, PhantomPlugin, ProbePlugin, UnwrapPlugin, PrefilterPlugin));
        })?;
        let size = UVec2::new(640, 480);
        let shade = |i: u32, darker: u32| [(i % 251) as u8 / 2 + 60 - darker as u8, (i % 13) as u8 + 90, 120, 255];
        let picture =
            |darker| FramePixels::new(size, (0..size.element_product()).flat_map(|i| shade(i, darker)).collect());
        let pictures = [picture(0), picture(20)].map(|pixels| pixels.map(Arc::new));
        let [Some(light), Some(dark)] = pictures else { return Err("a picture has the wrong size".into()) };
        let intrinsics = Intrinsics::new(Vec2::splat(600.0), 0.5 * size.as_vec2(), size);
        let camera = (ArCamera::new(intrinsics), Camera { is_active: false, ..default() });
        let camera = app.world_mut().spawn(camera).id();
        app.world_mut().spawn((LightProbeSphere::default(), Transform::from_xyz(0.0, 0.0, -0.6)));
        let mut path = Self { app, camera, pictures: [light, dark] };
        (0..WARM_UP).for_each(|i| {
            path.frame(i);
        });
        Ok(path)
    }

    fn frame(&mut self, i: usize) -> f64 {
        let feed = CameraFeed::pixels(self.pictures[i % 2].clone()).with_pace(FeedPace::Lockstep);
        self.app.world_mut().entity_mut(self.camera).insert(feed);
        frame(&mut self.app)
    }
}

/// Renders one frame and returns the time until the GPU has finished it, in milliseconds.
fn frame(app: &mut App) -> f64 {
    let started = Instant::now();
    app.update();
    filter_truth::wait(app.sub_app(RenderApp).world().resource::<RenderDevice>());
    started.elapsed().as_secs_f64() * 1e3
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> Outcome<()> {
    let options = Options::from_command_line()?;
    let mut maps: Vec<(&str, Radiance)> = vec![
        ("constant", Box::new(|_| DVec3::ONE)),
        ("one_plus_z", Box::new(|dir| DVec3::splat(1.0 + dir.z))),
        ("two_suns", Box::new(filter_truth::two_suns)),
    ];
    for (room, file) in ROOMS {
        if let Some(path) = shared_data::find(&format!("hdr/{file}")) {
            maps.push((room, Box::new(filter_truth::picture(&path))));
        }
    }
    let sizes = if options.blocks == 0 { &[][..] } else { &SIZES[..] };
    if options.directions == 0 {
        maps.clear();
    }
    let mut csv = "map,size,mip,ours_ms,bevy_ms,ratio,ours_rmse,bevy_rmse,ours_seam,bevy_seam\n".to_owned();
    let mut generator_ms = None;
    for &size in sizes {
        let texels = radiance_cube::texels(size, filter_truth::two_suns);
        let (mut ours, _) = app(size, &texels, LiveEnvironment::new)?;
        let (mut bevy, _) =
            app(size, &texels, |environment_map| GeneratedEnvironmentMapLight { environment_map, ..default() })?;
        // A frame in which nothing is filtered: its cost is part of both times.
        let (mut idle, _) = app(size, &texels, |source| LiveEnvironment::new(source).with_refresh(Refresh::OnRequest))?;
        let (mut ours_ms, mut bevy_ms, mut idle_ms) = (Vec::new(), Vec::new(), Vec::new());
        for block in 0..2 * options.blocks {
            // In the order ABBA, so that neither always runs on the warmer machine.
            let (times, app) = if block % 4 % 3 == 0 { (&mut ours_ms, &mut ours) } else { (&mut bevy_ms, &mut bevy) };
            times.extend((0..BLOCK).map(|_| frame(app)));
            idle_ms.extend((0..BLOCK).map(|_| frame(&mut idle)));
        }
        let (ours, bevy, idle) = (median(ours_ms), median(bevy_ms), median(idle_ms));
        println!(
            "{size}²: ours {ours:.1} ms, Bevy {bevy:.1} ms, ratio {:.2}; idle frame {idle:.1} ms, without it {:.2}",
            bevy / ours,
            (bevy - idle) / (ours - idle)
        );
        writeln!(
            csv,
            "two_suns,{size},all,{:.3},{:.3},{:.3},,,,",
            ours - idle,
            bevy - idle,
            (bevy - idle) / (ours - idle)
        )?;
        generator_ms = Some(bevy - idle);
    }
    if let Some(bevy) = generator_ms {
        let mut path = WholePath::new()?;
        let times = (0..2 * options.blocks * BLOCK).map(|i| path.frame(i)).collect();
        let idle = median((0..2 * BLOCK).map(|_| frame(&mut path.app)).collect());
        let ours = median(times);
        println!(
            "640 × 480 picture to filtered maps: {ours:.1} ms, idle frame {idle:.1} ms; {:.2} of Bevy's filter at 256²",
            (ours - idle) / bevy
        );
        writeln!(csv, "picture,128,all,{:.3},{bevy:.3},{:.3},,,,", ours - idle, bevy / (ours - idle))?;
    }
    for (name, radiance) in maps {
        compare(name, SIZES[0], radiance, &options, &mut csv)?;
    }
    match options.csv {
        Some(path) => std::fs::write(path, csv)?,
        None => print!("{csv}"),
    }
    Ok(())
}

fn compare(name: &str, size: usize, radiance: Radiance, options: &Options, csv: &mut String) -> Outcome<()> {
    let directions = options.directions;
    let texels = radiance_cube::texels(size, radiance);
    let truth = Truth::of(SpecularLobe::Ggx, size, &texels, directions);
    let read = |(mut app, entity): (App, Entity)| -> Outcome<_> {
        let maps = app.world().get::<EnvironmentMapLight>(entity).ok_or("there are no maps")?.clone();
        Ok(filter_truth::read(&mut app, &maps.diffuse_map, &maps.specular_map, directions))
    };
    let ours = read(app(size, &texels, LiveEnvironment::new)?)?;
    let bevy =
        read(app(size, &texels, |environment_map| GeneratedEnvironmentMapLight { environment_map, ..default() })?)?;
    for k in 0..ours.len() {
        let mip = k.checked_sub(1).map_or("diffuse".to_owned(), |k| ROUGHNESSES[k].to_string());
        let errors = [relative_rmse(&ours[k], &truth.ours[k]), relative_rmse(&bevy[k], &truth.bevy[k])];
        // A map without steps has no ratio of steps.
        let seam_ratio =
            |got: &[DVec3], truth: &[DVec3]| if seam(truth) > 1e-6 { seam(got) / seam(truth) } else { 1.0 + seam(got) };
        let seams = [seam_ratio(&ours[k], &truth.ours[k]), seam_ratio(&bevy[k], &truth.bevy[k])];
        let peaks = [brightest(&ours[k]) / brightest(&truth.ours[k]), brightest(&bevy[k]) / brightest(&truth.bevy[k])];
        println!(
            "{name} {mip}: RMSE {:.3} % (Bevy {:.3} %), seam {:.3} ({:.3}), peak {:.3} ({:.3})",
            1e2 * errors[0],
            1e2 * errors[1],
            seams[0],
            seams[1],
            peaks[0],
            peaks[1]
        );
        writeln!(csv, "{name},{size},{mip},,,,{:.6},{:.6},{:.4},{:.4}", errors[0], errors[1], seams[0], seams[1])?;
    }
    Ok(())
}
