//! Path-traced photographs of rooms whose light is known.

use super::{ENERGY_VARIATION, KEY_LIGHT_DEGREES, TILTED_TOLERANCE, noisy, variation};
use crate::{
    shared_data,
    solved::{irradiance_from_above, normals},
    truth::{ROOMS, TrueSky, desk_picture},
};
use bevy::prelude::*;
use bevy_mirrorball::lighting::solver::{DeskFrame, SolverCache, solve_light};
use std::sync::Arc;

/// Maximum relative error of irradiance at the marker, per channel, where the paper is not clipped.
const MARKER_TOLERANCE: f32 = 0.1;
/// Paper brighter than this in a channel is clipped in part.
const CLIPPED_PAPER: f32 = 0.95;
/// Seeds of camera noise.
const NOISE_SEEDS: u64 = 20;

#[test]
fn recovered_light_shines_like_the_true_room() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    let mut has_failed = false;
    for room in ROOMS {
        let picture = desk_picture(&folder, room);
        let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
        let sky = TrueSky::open(&folder, room);
        let off = normals().map(|normal| {
            let truth = sky.irradiance_from_above(normal);
            ((irradiance_from_above(&solved, normal) - truth) / truth).abs()
        });
        let paper = 0.8 * sky.irradiance_from_above(Vec3::Y);
        let at_marker = Vec3::select(paper.cmplt(Vec3::splat(CLIPPED_PAPER)), off[7], Vec3::ZERO).max_element();
        let tilted = off[..7].iter().map(|off| off.max_element()).fold(0.0, f32::max);
        println!(
            "{room}: {} regions, {} points, residual {:.3}, condition {:.0}; off at the marker {at_marker:.3}, \
             tilted {tilted:.3}",
            solved.regions.len(),
            solved.points,
            solved.residual,
            solved.condition
        );
        has_failed |= at_marker > MARKER_TOLERANCE || tilted > TILTED_TOLERANCE;
    }
    assert!(!has_failed);
}

#[test]
fn the_key_light_of_the_studio_is_where_it_is() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    let picture = desk_picture(&folder, "open_studio");
    let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
    let key = solved.lights()[0];
    let (elevation, azimuth) = (41.7_f32.to_radians(), -99.0_f32.to_radians());
    let truth = Vec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos());
    let degrees = key.direction.angle_between(truth).to_degrees();
    println!("key light {degrees:.2}° off, {key:?}");
    assert!(degrees <= KEY_LIGHT_DEGREES && key.fraction > 0.5);
}

/// The lamps of the warehouse are white. What else is wrong with the desk must not color the faint ones.
#[test]
fn small_lamps_of_the_warehouse_are_hardly_colored() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    let picture = desk_picture(&folder, "open_warehouse");
    let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
    let is_lamp = |extra: &Vec3| extra.max_element() > 1.0;
    let small = solved.regions.iter().filter(|region| region.solid_angle < 0.02).map(|region| region.gain - 1.0);
    let ratios: Vec<f32> = small.filter(is_lamp).map(|extra| extra.max_element() / extra.min_element()).collect();
    println!("brightest to darkest channel of small lamps: {ratios:?}");
    assert!(!ratios.is_empty() && ratios.iter().all(|ratio| *ratio < 2.5));
}

#[test]
fn energies_hardly_vary_with_the_noise_of_the_camera() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    for room in ["open_studio", "open_warehouse"] {
        let picture = desk_picture(&folder, room);
        let mut cache = SolverCache::default();
        let keys: Vec<_> = (0..NOISE_SEEDS)
            .map(|seed| {
                let picture = DeskFrame { frame: Arc::new(noisy(&picture.frame, seed)), ..picture.clone() };
                solve_light(&picture, &mut cache).expect("in view").lights()[0].irradiance.element_sum()
            })
            .collect();
        let variation = variation(&keys);
        println!("{room}: key light {:.3} ± {:.2} %", keys[0], 100.0 * variation);
        assert!(variation <= ENERGY_VARIATION);
    }
}
