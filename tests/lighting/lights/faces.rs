//! What faces of real things and the marker's ink tell of the light, where the paper alone would not.

use crate::{
    solved::{irradiance_from_above, normals},
    traced_desk::{Tent, TracedDesk},
};
use bevy::prelude::*;
use bevy_mirrorball::lighting::solver::{DeskFrame, SolverCache, solve_light};
use std::sync::Arc;

/// A skylight, and a tinted window low behind the camera. The ball clips both, and the paper hardly sees the window.
fn room_with_window(dir: Vec3) -> Vec3 {
    const TO_WINDOW: Vec3 = Vec3::new(0.6, 0.34, -0.72);
    const TO_SKYLIGHT: Vec3 = Vec3::new(-0.3, 0.91, 0.3);
    if dir.angle_between(TO_WINDOW) < 0.3 {
        Vec3::new(3.5, 5.0, 6.5)
    } else if dir.angle_between(TO_SKYLIGHT) < 0.3 {
        Vec3::new(3.0, 2.8, 2.5)
    } else {
        Vec3::new(0.5, 0.47, 0.45)
    }
}

/// A roof of a paint that nobody knows. The camera sees both of its faces, the window hardly more than one.
fn tent(foot: Vec3, reflectance: f32) -> Tent {
    Tent { foot, ridge: Vec3::Z, size: Vec3::new(0.07, 0.05, 0.03), reflectance }
}

/// Largest relative error of irradiance at the marker and at surfaces tilted by 53°, per channel.
fn worst_error(desk: &TracedDesk, phantoms: &[Tent]) -> Vec3 {
    let solids = phantoms.iter().map(|tent| tent.solid(false)).collect();
    let picture = DeskFrame { phantoms: Arc::new(solids), ..desk.picture() };
    let solved = solve_light(&picture, &mut SolverCache::default()).expect("ball and paper are in view");
    let off = |normal: Vec3| {
        let truth = desk.irradiance_from_above(normal);
        ((irradiance_from_above(&solved, normal) - truth) / truth).abs()
    };
    normals().map(off).into_iter().fold(Vec3::ZERO, Vec3::max)
}

#[test]
fn light_on_one_face_of_a_small_thing_is_not_taken_for_its_paint() {
    let mut desk = TracedDesk::new(&room_with_window);
    desk.size = UVec2::new(640, 360);
    let tents = [tent(Vec3::new(0.13, 0.0, 0.1), 0.5)];
    desk.tents = tents.to_vec();
    let (with, without) = (worst_error(&desk, &tents), worst_error(&desk, &[]));
    println!("off by {with:.3} with the faces of a small thing, {without:.3} without");
    assert!(with.max_element() < 0.05 && without.max_element() > 0.25);
}

#[test]
fn ink_tells_the_light_of_a_channel_in_which_the_paper_clips() {
    let blue = |dir: Vec3| room_with_window(dir) * Vec3::new(1.0, 1.1, 1.5);
    let off = [0.04, 0.8].map(|ink| {
        let mut desk = TracedDesk::new(&blue);
        (desk.size, desk.paper, desk.ink) = (UVec2::new(640, 360), 1.15, ink);
        let tents = [tent(Vec3::new(0.13, 0.0, 0.1), 0.5)];
        desk.tents = tents.to_vec();
        worst_error(&desk, &tents)
    });
    println!("paper clips in blue: off by {:.3} with a marker's ink, {:.3} without", off[0], off[1]);
    assert!(off[0].max_element() < 0.05 && off[1].z > 0.15);
}
