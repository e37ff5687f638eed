//! A sun in bright clouds: the ball shows both clipped, and only the shadows on the desk show where the sun is.

use crate::{
    shared_data,
    traced_desk::{Lamp, Tent, TracedDesk},
    truth::{ROOMS, TrueSky, desk_picture},
};
use bevy::prelude::*;
use bevy_mirrorball::lighting::solver::{DeskFrame, DetectedLight, PhantomSolid, SolverCache, solve_light};
use std::sync::Arc;

/// Maximum error of the direction of the sun, in degrees.
const SUN_DEGREES: f32 = 1.0;
/// Maximum relative error of the irradiance of the sun.
const SUN_TOLERANCE: f32 = 0.15;
/// Lights of this angular radius and below are those that are found by their shadows.
const SMALL: f32 = 0.006;

fn suns(picture: &DeskFrame) -> (Vec<DetectedLight>, f32) {
    let solved = solve_light(picture, &mut SolverCache::default()).expect("ball and paper are in view");
    let small = solved.lights().into_iter().filter(|light| light.angular_radius < SMALL).collect();
    (small, solved.residual)
}

#[test]
fn the_sun_of_the_city_is_found_by_its_shadows_and_no_other_room_has_one() {
    let Some(folder) = shared_data::find("ar_truth") else { return };
    for room in ROOMS {
        let (found, residual) = suns(&desk_picture(&folder, room));
        println!("{room}: residual {residual:.3}, {found:?}");
        assert!(found.is_empty(), "{room} has no sun");
    }
    let truth = Vec3::new(0.093_81, 0.740_75, 0.665_20).normalize();
    let (found, residual) = suns(&desk_picture(&folder, "open_city"));
    let [sun] = found[..] else { panic!("{found:?}") };
    let degrees = sun.direction.angle_between(truth).to_degrees();
    let sky = TrueSky::open(&folder, "open_city");
    let expected = sky.irradiance_around(truth, 0.02);
    println!("city: residual {residual:.3}, sun {degrees:.2}° off, {:.3} of {expected:.3}", sun.irradiance);
    assert!(degrees <= SUN_DEGREES);
    assert!((sun.irradiance / expected - 1.0).abs().max_element() <= SUN_TOLERANCE);
}

/// Desk with folded paper on it, for the solver.
fn picture(desk: &TracedDesk) -> DeskFrame {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.0, z);
    let [a, b, c, d] = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    let mut table = PhantomSolid::from_triangles(vec![[a, b, c], [a, c, d]]).expect("two triangles");
    table.casts = false;
    let tents = desk.tents.iter().map(|tent| tent.solid(false));
    DeskFrame { phantoms: Arc::new(tents.chain([table]).collect()), ..desk.picture() }
}

#[test]
fn a_sun_in_clouds_that_clip_is_found_and_clouds_alone_have_none() {
    // They clip within 25° of a direction, over a blue sky.
    let clouds = Lamp::far(Vec3::new(0.25, 0.8, 0.5), 0.44, Vec3::splat(3.0));
    let sky = |_: Vec3| Vec3::new(0.15, 0.18, 0.25);
    // Off the middle of the clouds, by up to 18°.
    for sun in [Vec3::new(0.4, 0.8, 0.35), Vec3::new(0.0, 0.75, 0.6)].map(Vec3::normalize) {
        let mut desk = TracedDesk::new(&sky);
        desk.lamps = vec![clouds];
        desk.size = UVec2::new(960, 540);
        desk.tents = vec![Tent {
            foot: Vec3::new(0.12, 0.0, -0.05),
            ridge: Vec3::new(1.0, 0.0, 0.4),
            size: Vec3::new(0.1, 0.03, 0.07),
            reflectance: 0.5,
        }];
        let without = suns(&picture(&desk));
        assert!(without.0.is_empty(), "{without:?}");
        desk.lamps.insert(0, Lamp::far(sun, 0.0047, Vec3::splat(2.0e4)));
        let (found, residual) = suns(&picture(&desk));
        let [light] = found[..] else { panic!("{found:?}") };
        let degrees = light.direction.angle_between(sun).to_degrees();
        let expected = 2.0e4 * std::f32::consts::PI * 0.0047_f32.powi(2) * desk.exposure();
        println!("residual {residual:.3}: sun {degrees:.2}° off, {:.3} of {expected:.3}", light.irradiance);
        assert!(degrees <= SUN_DEGREES);
        assert!((light.irradiance / expected - 1.0).abs().max_element() <= SUN_TOLERANCE);
    }
}
