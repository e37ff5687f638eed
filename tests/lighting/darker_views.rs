//! Recovery of clipped light from darker views of it: a dark ball, shorter exposures. Needs no GPU.

use crate::solved::{irradiance_from, irradiance_from_above, normals};
use crate::traced_desk::{Lamp, TracedDesk};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_mirrorball::{
    camera::{CameraPlugin, FramePixels},
    lighting::{
        LightingPlugin, RecoveredLight,
        solver::{
            BracketedExposure, DeskFrame, MirrorBall, Paper, SolvedLight, SolvedRegion, SolverCache, solve_light,
        },
    },
    phantom::PhantomPlugin,
    prelude::*,
    probe::{BallSurface, ProbePlugin},
    tracking::{DetectedMarker, LumaView, MarkerDetection, MarkerDetector, MarkerFamily, TrackingPlugin},
};
use std::{sync::Arc, time::Duration};

/// Maximum relative error of irradiance at tilted surfaces with a dark ball beside the bright one, without the desk.
const DARK_BALL_TOLERANCE: f32 = 0.1;

#[test]
fn a_dark_ball_tells_how_bright_the_lamps_are_without_the_desk() {
    let sky = |dir: Vec3| Vec3::new(0.25, 0.3, 0.4) * (0.5 + 0.5 * dir.y);
    let lamps = [
        (Vec3::new(1.0, 0.75, 0.2), Vec3::new(18.0, 15.0, 12.0)),
        (Vec3::new(-1.0, 0.75, 0.2), Vec3::splat(6.0)),
        (Vec3::new(0.85, 0.25, 0.5), Vec3::new(4.0, 6.0, 8.0)),
    ];
    let center = Vec3::new(0.17, 0.035, 0.16);
    for surface in [BallSurface::Mirror, BallSurface::Dielectric] {
        let mut desk = TracedDesk::new(&sky);
        desk.lamps = lamps.map(|(dir, radiance)| Lamp::far(dir, 0.16, radiance)).to_vec();
        desk.balls.push(MirrorBall { center, radius: 0.035, reflectance: 0.04, surface });
        let both = desk.picture();
        let alone = DeskFrame { other_balls: Vec::new(), ..both.clone() };
        let off = [alone, both].map(|picture| {
            let solved = solve_light(&picture, &mut SolverCache::default()).expect("balls and paper are in view");
            println!(
                "{surface:?}: {} of {} regions read in the dark ball",
                solved.bracketed_regions,
                solved.regions.len()
            );
            normals().map(|normal| {
                let truth = desk.irradiance_from_above(normal);
                ((irradiance_from_above(&solved, normal) - truth) / truth).abs().max_element()
            })
        });
        println!(
            "{surface:?}: off at seven tilted normals and the marker's: alone {:.3?}, with the dark ball {:.3?}",
            off[0], off[1]
        );
        let worst = |off: [f32; 8]| off.into_iter().fold(0.0, f32::max);
        assert!(worst(off[0]) > 2.0 * DARK_BALL_TOLERANCE, "the scene is no test");
        assert!(worst(off[1]) <= DARK_BALL_TOLERANCE);
    }
}

/// Maximum relative error of irradiance at tilted surfaces with shorter exposures, without the desk.
const SERIES_TOLERANCE: f32 = 0.03;
/// Maximum relative error of a lamp's own light.
const SERIES_LAMP_TOLERANCE: f32 = 0.04;
/// Maximum relative error of the brightest lamp's own light where even the shorter exposure clips it and the paper
/// gives the rest.
const BOUND_LAMP_TOLERANCE: f32 = 0.1;

/// Three lamps, 90, 18 and 4 times white in the picture, and how shorter exposures tell of them.
struct Series {
    alone: DeskFrame,
    desk: TracedDesk<'static>,
}

impl Series {
    const RADIUS: f32 = 0.1;
    const LAMPS: [(Vec3, Vec3); 3] = [
        (Vec3::new(1.0, 0.75, 0.2), Vec3::new(180.0, 150.0, 120.0)),
        (Vec3::new(-1.0, 0.75, 0.2), Vec3::splat(30.0)),
        (Vec3::new(0.85, 0.25, 0.5), Vec3::new(4.0, 6.0, 8.0)),
    ];

    fn new() -> Self {
        let mut desk = TracedDesk::new(&|dir| Vec3::new(0.25, 0.3, 0.4) * (0.5 + 0.5 * dir.y));
        desk.lamps = Self::LAMPS.map(|(dir, radiance)| Lamp::far(dir, Self::RADIUS, radiance)).to_vec();
        Self { alone: desk.picture(), desk }
    }

    fn lamps_off(&self, solved: &SolvedLight) -> [f32; 3] {
        Self::LAMPS.map(|(dir, radiance)| {
            let lamp = std::f32::consts::PI * Self::RADIUS.sin().powi(2) * radiance.element_sum() / 3.0;
            let truth = (lamp + self.desk.sky_around(dir, 15_f32.to_radians())) * self.desk.exposure();
            irradiance_from(solved, dir.normalize()) / truth - 1.0
        })
    }

    /// How far off each lamp is, and the worst of eight surfaces.
    fn off(&self, bracketed_exposures: Vec<BracketedExposure>) -> ([f32; 3], f32) {
        let exposures: Vec<f32> = bracketed_exposures.iter().map(|shorter| shorter.exposure).collect();
        let picture = DeskFrame { bracketed_exposures, ..self.alone.clone() };
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
        let lamps = self.lamps_off(&solved);
        let surfaces = normals().map(|normal| {
            let truth = self.desk.irradiance_from_above(normal);
            ((irradiance_from_above(&solved, normal) - truth) / truth).abs().max_element()
        });
        let worst = surfaces.into_iter().fold(0.0, f32::max);
        println!(
            "exposures {exposures:.3?}: lamps {lamps:+.3?}, worst surface {worst:.3}, {} of {} pieces read",
            solved.bracketed_regions,
            solved.regions.len()
        );
        (lamps, worst)
    }

    fn assert_told(&self, shorter: Vec<BracketedExposure>) {
        let (lamps, worst) = self.off(shorter);
        assert!(lamps.iter().all(|off| off.abs() <= SERIES_LAMP_TOLERANCE) && worst <= SERIES_TOLERANCE);
    }
}

/// Maximum relative error of the light of a lamp 2° wide, which spans a few pixels of the ball.
const SMALL_LAMP_TOLERANCE: f32 = 0.2;

#[test]
fn a_shorter_exposure_tells_the_color_of_a_small_lamp() {
    let red = (Vec3::new(1.0, 0.75, 0.2), Vec3::new(1600.0, 240.0, 160.0));
    let white = (Vec3::new(-1.0, 0.75, 0.2), Vec3::splat(1600.0));
    let mut desk = TracedDesk::new(&|dir| Vec3::new(0.25, 0.3, 0.4) * (0.5 + 0.5 * dir.y));
    desk.lamps = [red, white].map(|(dir, radiance)| Lamp::far(dir, 0.02, radiance)).to_vec();
    let picture = DeskFrame {
        bracketed_exposures: [0.03, 0.001].map(|exposure| desk.shorter(exposure)).to_vec(),
        ..desk.picture()
    };
    let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
    let facing_it = red.0.normalize();
    let truth = desk.irradiance_from_above(facing_it);
    let off = ((irradiance_from_above(&solved, facing_it) - truth) / truth).abs();
    println!("irradiance {truth}, off by {off}");
    assert!(off.max_element() < SMALL_LAMP_TOLERANCE);
}

#[test]
fn a_series_of_exposures_tells_how_bright_each_lamp_is_without_the_desk() {
    let series = Series::new();
    let (_, worst) = series.off(Vec::new());
    assert!(worst > 10.0 * SERIES_TOLERANCE, "the scene is no test");
    series.assert_told(vec![series.desk.shorter(0.008)]);
    series.assert_told([0.125, 0.008].map(|exposure| series.desk.shorter(exposure)).to_vec());
    // From elsewhere, and in other order and size.
    let mut elsewhere = series.desk.clone();
    elsewhere.eye += Vec3::new(0.03, 0.02, -0.01);
    elsewhere.size = UVec2::new(640, 360);
    let camera_from_world = Some(elsewhere.picture().camera_from_world);
    let shorter = [0.008, 0.125].map(|exposure| BracketedExposure { camera_from_world, ..elsewhere.shorter(exposure) });
    series.assert_told(shorter.to_vec());
}

/// Finds the marker where it is known to be.
struct KnownMarker(DetectedMarker);

impl KnownMarker {
    fn of(picture: &DeskFrame) -> MarkerDetection {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, z)| {
            let pos_camera = picture.camera_from_world.transform_point3(0.05 * Vec3::new(x, 0.0, z));
            picture.intrinsics.project(pos_camera).expect("is in view").as_dvec2()
        });
        MarkerDetection::new(Self(DetectedMarker { family: MarkerFamily::Tag36h11, id: 0, corners, corrected_bits: 0 }))
    }
}

impl MarkerDetector for KnownMarker {
    fn detect(&mut self, _picture: LumaView, _decimation: f32) -> Vec<DetectedMarker> {
        vec![self.0.clone()]
    }
}

#[test]
fn shorter_exposures_of_a_feed_tell_a_game_how_bright_its_lamps_are() {
    let series = Series::new();
    let picture = &series.alone;
    let mut app = App::new();
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(100)))
        .insert_resource(KnownMarker::of(picture))
        .add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin, CameraPlugin, TrackingPlugin))
        .init_asset::<bevy::shader::Shader>()
        .init_asset::<Mesh>()
        .init_asset::<Image>()
        .add_plugins((PhantomPlugin, ProbePlugin, LightingPlugin));
    let feed = |frame: &Arc<FramePixels>| CameraFeed::pixels(frame.clone()).with_pace(FeedPace::Lockstep);
    let camera = app.world_mut().spawn((ArCamera::new(picture.intrinsics), feed(&picture.frame))).id();
    app.world_mut().spawn((MarkerAnchor::new(0, 0.1), WorldOrigin));
    let MirrorBall { center, radius, reflectance, .. } = picture.ball;
    let probe = LightProbeSphere { radius, reflectance, ..default() };
    let probe = app.world_mut().spawn((probe, Transform::from_translation(center))).id();
    let off = |app: &App| {
        let light = app.world().get::<RecoveredLight>(probe).expect("ball and paper are in view");
        (light.is_solved, series.lamps_off(&light.light))
    };
    app.update();
    app.update();
    let (is_solved, without) = off(&app);
    println!("lamps without shorter exposures {without:+.3?}, solved {is_solved}");
    assert!(!is_solved, "flat paper alone tells too little");
    let shown = app.world().get::<CameraFrame>(camera).expect("is shown").sequence;
    for exposure in [0.008, 0.125] {
        let shorter = series.desk.shorter(exposure);
        app.world_mut().entity_mut(camera).insert(feed(&shorter.frame).with_exposure(exposure));
        app.update();
        assert_eq!(app.world().get::<CameraFrame>(camera).expect("is shown").sequence, shown);
    }
    assert_eq!(off(&app), (false, without), "they count with the next picture");
    app.world_mut().entity_mut(camera).insert(feed(&picture.frame));
    app.update();
    app.update();
    let (is_solved, with) = off(&app);
    println!("lamps with shorter exposures {with:+.3?}");
    assert!(is_solved && with.iter().all(|off| off.abs() <= SERIES_LAMP_TOLERANCE));
    // Once they are old, they tell nothing.
    app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs(60)));
    app.update();
    app.world_mut().entity_mut(camera).insert(feed(&picture.frame));
    app.update();
    app.update();
    assert_eq!(off(&app), (false, without));
}

#[test]
fn what_a_shorter_exposure_clips_too_is_a_lower_bound() {
    let series = Series::new();
    let ([brightest, others @ ..], _) = series.off(vec![series.desk.shorter(0.0157)]);
    assert!(brightest.abs() <= BOUND_LAMP_TOLERANCE, "the paper tells what the bound leaves open");
    assert!(others.iter().all(|off| off.abs() <= SERIES_LAMP_TOLERANCE));
    // The least that the bound leaves to a paper that calls for little light.
    let gain = |shorter: &[f32], reflectance: f32| {
        let bracketed_exposures = shorter.iter().map(|exposure| series.desk.shorter(*exposure)).collect();
        let papers = series.alone.papers.iter().map(|paper| Paper { reflectance, ..*paper }).collect();
        let picture = DeskFrame { bracketed_exposures, papers, ..series.alone.clone() };
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
        let towards = Series::LAMPS[0].0.normalize();
        let along = |region: &&SolvedRegion| region.direction.dot(towards);
        let region = solved.regions.iter().max_by(|a, b| along(a).total_cmp(&along(b))).expect("is clipped");
        region.gain.element_sum() / 3.0
    };
    let (told, without, with) = (gain(&[0.008], 0.8), gain(&[], 1.0), gain(&[0.0157], 1.0));
    println!(
        "gain of the brightest: {told:.1}; with a paper that is too dark: {without:.1}, with the bound too: {with:.1}"
    );
    assert!(without < 0.5 * told && with > 0.6 * told && with < told);
}

#[test]
fn a_shorter_exposure_of_other_light_or_of_another_exposure_than_it_says_is_not_believed() {
    let series = Series::new();
    let without = series.off(Vec::new());
    let claims = |said: f32| vec![BracketedExposure { exposure: said, ..series.desk.shorter(0.0625) }];
    for said in [0.03, 0.12, 0.0, 1.0, -1.0, f32::NAN] {
        assert_eq!(series.off(claims(said)), without, "{said}");
    }
    let mut later = series.desk.clone();
    later.lamps.remove(0);
    // Of the same camera: its exposure does not change with the light.
    let said = 0.125;
    let shorter = later.shorter(said * series.desk.exposure() / later.exposure());
    assert_eq!(series.off(vec![BracketedExposure { exposure: said, ..shorter }]), without);
}
