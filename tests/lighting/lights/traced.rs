//! Ray-traced desks under skies and lamps of known radiance.

use super::{ENERGY_VARIATION, KEY_LIGHT_DEGREES, noisy, variation};
use crate::{
    shared_data,
    solved::irradiance_from,
    traced_desk::{Lamp, Tent, TracedDesk},
};
use bevy::prelude::*;
use bevy_mirrorball::{
    camera::FramePixels,
    environment_map::{EquirectPixels, equirect_direction},
    lighting::{
        match_cameras,
        solver::{DeskFrame, DetectedLight, MirrorBall, SolverCache, solve_light},
    },
    probe::BallSurface,
};
use std::sync::Arc;

#[test]
fn the_suns_of_ray_traced_balls_are_found_and_none_is_invented() {
    let found = |environment: &dyn Fn(Vec3) -> Vec3| {
        let picture = TracedDesk::new(environment).picture();
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
        solved.lights()
    };
    let overcast = |dir: Vec3| Vec3::splat((1.0 + 2.0 * dir.y.max(0.0)) / 3.0);
    assert_eq!(found(&|_| Vec3::ONE), [], "a uniform sky has no lights");
    assert_eq!(found(&overcast), [], "an overcast sky has no lights");
    let suns = [Vec3::new(0.5, 0.6, 0.7), Vec3::new(-0.8, 0.35, 0.3)].map(Vec3::normalize);
    let lights = found(&|dir| {
        let sky = Vec3::new(0.2, 0.3, 0.5);
        match suns.map(|sun| dir.angle_between(sun)) {
            [a, _] if a < 0.03 => Vec3::new(900.0, 800.0, 600.0),
            [_, b] if b < 0.03 => Vec3::splat(700.0),
            _ => sky,
        }
    });
    assert_eq!(lights.len(), 2, "{lights:?}");
    for sun in suns {
        let degrees =
            lights.iter().map(|light| light.direction.angle_between(sun).to_degrees()).fold(f32::MAX, f32::min);
        println!("sun {degrees:.2}° off");
        assert!(degrees <= KEY_LIGHT_DEGREES);
    }
}

/// Seeds for pictures of balls under measured maps.
const MAP_SEEDS: u64 = 5;

/// A bright and a dark ball under a map. Interior: where its strongest lamp is, not how strong, for it clips in the
/// dark ball too.
#[test]
fn the_strongest_lights_of_measured_maps_are_found_where_the_maps_have_them() {
    let Some(folder) = shared_data::find("hdr") else { return };
    for name in ["sunrise", "interior", "night"] {
        let map = EquirectPixels::open(folder.join(format!("{name}.exr"))).expect("an OpenEXR file");
        let truth = strongest_light(&map);
        let sky = |dir: Vec3| map.sample(dir);
        let mut desk = TracedDesk::new(&sky);
        desk.size = UVec2::new(640, 360);
        let center = Vec3::new(0.17, 0.04, 0.17);
        desk.balls.push(MirrorBall { center, radius: 0.04, reflectance: 0.04, surface: BallSurface::Mirror });
        let picture = desk.picture();
        let mut cache = SolverCache::default();
        let (mut worst, mut energies) = (0.0_f32, Vec::new());
        for seed in 0..MAP_SEEDS {
            let picture = DeskFrame { frame: Arc::new(noisy(&picture.frame, seed)), ..picture.clone() };
            let solved = solve_light(&picture, &mut cache).expect("balls and paper are in view");
            let lights = solved.lights();
            let degrees = |light: &DetectedLight| light.direction.angle_between(truth).to_degrees();
            worst = worst.max(lights.iter().map(degrees).fold(f32::MAX, f32::min));
            energies.push(solved.irradiance(truth).element_sum());
        }
        let variation = variation(&energies);
        println!(
            "{name}: strongest light at {truth:.3} at most {worst:.2}° off, irradiance ± {:.2} %",
            100.0 * variation
        );
        assert!(worst <= KEY_LIGHT_DEGREES);
        assert!(variation <= ENERGY_VARIATION);
    }
}

/// Towards the middle of the 8° about the direction from which a map sends the most light.
fn strongest_light(map: &EquirectPixels) -> Vec3 {
    const STEPS: usize = 128;
    let coarse: Vec<(Vec3, f32)> = (0..STEPS * STEPS / 4)
        .map(|i| {
            let uv = (Vec2::new((i % STEPS) as f32, (i / STEPS) as f32) + 0.5) * Vec2::new(1.0, 2.0) / STEPS as f32;
            let dir = equirect_direction(uv);
            let side = map.size.x as usize / STEPS;
            let (x, y) = (i % STEPS * side, i / STEPS * side);
            let texels = (0..side * side).map(|k| map.texels[(y + k / side) * map.size.x as usize + x + k % side]);
            (dir, texels.map(Vec3::element_sum).sum::<f32>() * (1.0 - dir.y * dir.y).sqrt())
        })
        .collect();
    let around = |middle: Vec3| coarse.iter().filter(move |(dir, _)| dir.dot(middle) > 8_f32.to_radians().cos());
    let energy = |middle: Vec3| around(middle).map(|(_, energy)| energy).sum::<f32>();
    let strongest = coarse.iter().map(|(dir, _)| (*dir, energy(*dir))).max_by(|a, b| a.1.total_cmp(&b.1));
    around(strongest.expect("texels").0).map(|(dir, energy)| *dir * *energy).sum::<Vec3>().normalize()
}

/// Maximum relative error of the match of two cameras.
const MATCH_TOLERANCE: f32 = 0.02;

#[test]
fn two_cameras_are_matched_by_the_paper_both_see() {
    let sky = |dir: Vec3| Vec3::new(0.6, 0.5, 0.4) * (0.3 + dir.y);
    let mut desk = TracedDesk::new(&sky);
    desk.paper = 0.6;
    let first = desk.picture();
    desk.eye = Vec3::new(0.3, 0.45, -0.3);
    desk.target = Vec3::new(0.05, 0.0, 0.0);
    let second = desk.picture();
    let other = Vec3::new(0.5, 0.8, 1.3);
    let bytes = second.frame.rgba.chunks_exact(4).flat_map(|p| {
        let linear = Color::srgb_u8(p[0], p[1], p[2]).to_linear().to_vec3() * other;
        let clipped = linear.min(Vec3::ONE);
        Color::linear_rgb(clipped.x, clipped.y, clipped.z).to_srgba().to_u8_array()
    });
    let frame = Arc::new(FramePixels::new(second.frame.size, bytes.collect()).expect("the same size"));
    let matched = match_cameras(&first, &DeskFrame { frame, ..second.clone() }).expect("both see the paper");
    println!("{matched:?}");
    assert!((matched.gain * other - 1.0).abs().max_element() <= MATCH_TOLERANCE && matched.scatter < MATCH_TOLERANCE);
    let dark = Arc::new(FramePixels::new(first.frame.size, vec![255; first.frame.rgba.len()]).expect("the same size"));
    assert_eq!(match_cameras(&first, &DeskFrame { frame: dark, ..second }), None, "clipped paper tells nothing");
}

/// Maximum relative error of a lamp with folded paper on the desk.
const TENT_TOLERANCE: f32 = 0.1;

#[test]
fn folded_paper_tells_two_lamps_apart_that_flat_paper_cannot() {
    let sky = |_: Vec3| Vec3::splat(0.3);
    let lamps = [(Vec3::new(1.0, 0.75, 0.2), 90.0), (Vec3::new(-1.0, 0.75, 0.2), 30.0)];
    let mut desk = TracedDesk::new(&sky);
    desk.lamps = lamps.map(|(dir, radiance)| Lamp::far(dir, 0.12, Vec3::splat(radiance))).to_vec();
    desk.target.x = 0.07;
    let tent =
        Tent { foot: Vec3::new(-0.15, 0.0, 0.02), ridge: Vec3::Z, size: Vec3::new(0.1, 0.06, 0.035), reflectance: 0.6 };
    let alone = desk.picture();
    desk.tents = vec![tent];
    let with_tent = DeskFrame { phantoms: Arc::new(vec![tent.solid(true)]), ..desk.picture() };
    let off = [alone, with_tent].map(|picture| {
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
        lamps.map(|(dir, radiance)| {
            let truth = std::f32::consts::PI * 0.12_f32.sin().powi(2) * radiance * desk.exposure();
            irradiance_from(&solved, dir.normalize()) / truth - 1.0
        })
    });
    println!("lamps off: paper alone {:.3?}, with a tent {:.3?}", off[0], off[1]);
    assert!(off[0].iter().any(|off| off.abs() > 3.0 * TENT_TOLERANCE), "the scene is no test: {:?}", off[0]);
    assert!(off[1].iter().all(|off| off.abs() <= TENT_TOLERANCE), "{:?}", off[1]);
}

/// Maximum error of the position of a near lamp from two balls, as a fraction of its distance.
const MISPLACED: f32 = 0.15;

#[test]
fn two_balls_tell_where_a_near_lamp_is_and_that_a_far_one_is_far() {
    let sky = |_: Vec3| Vec3::splat(0.3);
    let near = Lamp { position: Vec3::new(-0.45, 0.75, 0.35), radius: 0.06, radiance: Vec3::splat(20.0) };
    let far = Lamp::far(Vec3::new(0.9, 0.8, -0.1), 0.1, Vec3::splat(20.0));
    // A second one of chrome, or a dark one.
    for reflectance in [0.65, 0.04] {
        let mut desk = TracedDesk::new(&sky);
        desk.lamps = vec![near, far];
        desk.size = UVec2::new(640, 360);
        let center = Vec3::new(0.06, 0.04, 0.17);
        desk.balls.push(MirrorBall { center, radius: 0.04, reflectance, surface: BallSurface::Mirror });
        let picture = desk.picture();
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("balls and paper are in view");
        let lights = picture.lights(&solved);
        let nearest = |dir: Vec3| {
            let angle = |light: &&DetectedLight| light.direction.angle_between(dir);
            lights.iter().min_by(|a, b| angle(a).total_cmp(&angle(b))).expect("lights are found")
        };
        let to_near = near.position - picture.ball.center;
        let placed = nearest(to_near.normalize());
        println!("second ball {reflectance}: near lamp {placed:.3?}, far {:.3?}", nearest(far.position.normalize()));
        let position = placed.position.expect("the near lamp has a place");
        let off = position.distance(near.position) / to_near.length();
        println!("{off:.3} of {} m off", to_near.length());
        assert!(off <= MISPLACED && placed.direction.angle_between(to_near).to_degrees() <= KEY_LIGHT_DEGREES);
        assert_eq!(nearest(far.position.normalize()).position, None, "a far lamp has no place");
    }
}
