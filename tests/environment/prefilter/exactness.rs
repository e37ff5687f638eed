//! Filtered maps against sums in double precision, and white objects in a white furnace.

use super::{FURNACE_TOLERANCE, cube, diffuse_and_glossy, lit_app, maps_source, worst_error};
use crate::{
    filter_truth::{self, ROUGHNESSES, Truth, brightest, relative_rmse, seam},
    radiance_cube::{cube_image, texels},
    shared_data,
};
use bevy::{
    camera::Exposure,
    light::{EnvironmentMapLight, GeneratedEnvironmentMapLight},
    math::DVec3,
    prelude::*,
};
use bevy_mirrorball::{
    headless,
    prefilter::{FilteredEnvironment, LiveEnvironment, SpecularLobe},
};

/// Half floats, and texels of a slope.
const SMOOTH_TOLERANCE: f64 = 2e-3;
/// The cosine's kink at the horizon cuts through blocks 11° wide, which count as evenly spread disks: the largest error
/// of all.
const HORIZON_TOLERANCE: f64 = 8e-3;
/// What a viewer could see in a slow gradient next to a correct one is 1 %; half of that.
const DIFFUSE_RMSE: f64 = 5e-3;
/// As much as rounding to 8 bits does to a mid gray; or half of what the engine's own filter is off, where that is
/// more.
const GLOSSY_RMSE: f64 = 1e-2;
/// Lobes without tails lose more by the interpolation between levels.
const COSINE_RMSE: f64 = 2.5e-2;
/// Error of cosine lobes relative to that of GGX lobes, where both are large: a small sun in a small cube is hard.
const COSINE_GROWTH: f64 = 1.2;
/// Steps across cube edges relative to those the environment itself makes there.
const SEAM_GROWTH: f64 = 1.5;
/// Brightest value relative to the brightest true one: no fireflies.
const MAX_PEAK: f64 = 1.05;
/// Rounding of the picture to 8 bits, and one step for the engine's own table of GGX albedo (11 bits in half floats).
const RENDERED_TOLERANCE: u8 = 1;

#[test]
fn a_constant_environment_stays_itself() {
    let radiance = DVec3::new(1.0, 0.5, 2.0);
    let Some((mut app, camera, _)) = lit_app(cube(32, |_| radiance)) else { return };
    let (diffuse, glossy) = diffuse_and_glossy(&mut app, camera);
    let (diffuse, glossy) = (worst_error(&diffuse, |_| radiance), worst_error(&glossy, |_| radiance));
    println!("furnace: diffuse off by {diffuse:.1e}, glossy by {glossy:.1e}");
    assert!(diffuse <= FURNACE_TOLERANCE && glossy <= FURNACE_TOLERANCE);
}

#[test]
fn a_linear_environment_gives_two_thirds_of_its_slope_on_every_axis() {
    // One axis per channel, so that no two axes or signs can be mixed up unnoticed. ∫ (n·d)₊ d dω / π = ⅔ n.
    let Some((mut app, camera, _)) = lit_app(cube(64, |dir| 1.0 + 0.8 * dir)) else { return };
    let (diffuse, glossy) = diffuse_and_glossy(&mut app, camera);
    let diffuse = worst_error(&diffuse, |normal| 1.0 + 0.8 * 2.0 / 3.0 * normal);
    let glossy = worst_error(&glossy, |dir| 1.0 + 0.8 * dir);
    println!("linear: diffuse off by {diffuse:.1e}, sharpest glossy level by {glossy:.1e}");
    assert!(diffuse <= HORIZON_TOLERANCE && glossy <= SMOOTH_TOLERANCE);
}

/// Both filters against their own sums over the same cube, as materials read them.
fn compare_with_bevy(name: &str, edge: usize, radiance: impl Fn(DVec3) -> DVec3) {
    const DIRECTIONS: usize = 12;
    let source = texels(edge, radiance);
    let Some((mut app, camera, _)) = lit_app(cube_image(edge, &source)) else { return };
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    let environment_map = maps_source(&app, camera);
    let bevy = app.world_mut().spawn(GeneratedEnvironmentMapLight { environment_map, ..default() }).id();
    for _ in 0..4 {
        app.update();
    }
    let bevy = app.world().get::<EnvironmentMapLight>(bevy).expect("Bevy takes the cube").clone();
    let ours = filter_truth::read(&mut app, &maps.diffuse, &maps.specular, DIRECTIONS);
    let bevy = filter_truth::read(&mut app, &bevy.diffuse_map, &bevy.specular_map, DIRECTIONS);
    let truth = Truth::of(SpecularLobe::Ggx, edge, &source, DIRECTIONS);
    for k in 0..ours.len() {
        let (error, theirs) = (relative_rmse(&ours[k], &truth.ours[k]), relative_rmse(&bevy[k], &truth.bevy[k]));
        let (step, true_step) = (seam(&ours[k]), seam(&truth.ours[k]));
        let peak = brightest(&ours[k]) / brightest(&truth.ours[k]);
        let what = k.checked_sub(1).map_or("diffuse".to_owned(), |k| format!("roughness {}", ROUGHNESSES[k]));
        println!(
            "{name}, {what}: {:.3} % off (Bevy {:.3} %), seam {step:.4} of {true_step:.4}, peak {peak:.3}",
            1e2 * error,
            1e2 * theirs
        );
        let allowed = if k == 0 { DIFFUSE_RMSE } else { GLOSSY_RMSE.max(0.5 * theirs) };
        assert!(error <= allowed, "{name}, {what}: {error} above {allowed}");
        assert!(step <= SEAM_GROWTH * true_step + FURNACE_TOLERANCE, "{name}, {what}: seam {step} of {true_step}");
        assert!(peak <= MAX_PEAK, "{name}, {what}: peak {peak}");
    }
}

/// Cosine lobes against sums over the same cube.
fn check_cosine_lobes(name: &str, edge: usize, radiance: impl Fn(DVec3) -> DVec3) {
    const DIRECTIONS: usize = 12;
    let source = texels(edge, radiance);
    let Some((mut app, camera, _)) = lit_app(cube_image(edge, &source)) else { return };
    let ggx = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    let filtered_by_ggx = filter_truth::read(&mut app, &ggx.diffuse, &ggx.specular, DIRECTIONS);
    let mut environment = app.world_mut().get_mut::<LiveEnvironment>(camera).expect("it has one");
    environment.lobe = SpecularLobe::Cosine;
    for _ in 0..4 {
        app.update();
    }
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("it has new ones").clone();
    assert_ne!(maps.specular, ggx.specular, "another lobe, other maps");
    let found = filter_truth::read(&mut app, &maps.diffuse, &maps.specular, DIRECTIONS);
    let [cosine, ggx] =
        [SpecularLobe::Cosine, SpecularLobe::Ggx].map(|lobe| Truth::of(lobe, edge, &source, DIRECTIONS).ours);
    for (k, (found, expected)) in found.iter().zip(&cosine).enumerate() {
        let (error, of_ggx) = (relative_rmse(found, expected), relative_rmse(&filtered_by_ggx[k], &ggx[k]));
        let between = relative_rmse(&ggx[k], expected);
        let peak = brightest(found) / brightest(expected);
        let what = k.checked_sub(1).map_or("diffuse".to_owned(), |k| format!("roughness {}", ROUGHNESSES[k]));
        let [percent, theirs, apart] = [error, of_ggx, between].map(|error| 1e2 * error);
        println!(
            "{name}, {what}: {percent:.3} % off (GGX {theirs:.3} %), the lobes {apart:.3} % apart, peak {peak:.3}"
        );
        assert!(error <= COSINE_RMSE.max(COSINE_GROWTH * of_ggx), "{name}, {what}: {error}");
        assert!(peak <= MAX_PEAK, "{name}, {what}: peak {peak}");
    }
}

#[test]
fn cosine_lobes_are_filtered_truly() {
    check_cosine_lobes("two suns", 128, filter_truth::two_suns);
    if let Some(path) = shared_data::find("hdr/lebombo_1k.hdr") {
        check_cosine_lobes("lebombo", 128, filter_truth::picture(&path));
    }
}

#[test]
fn two_suns_are_filtered_more_truly_than_by_the_engine() {
    compare_with_bevy("two suns", 128, filter_truth::two_suns);
}

#[test]
fn real_rooms_are_filtered_truly() {
    for room in ["lebombo", "venice_sunset"] {
        let Some(path) = shared_data::find(&format!("hdr/{room}_1k.hdr")) else { return };
        compare_with_bevy(room, 128, filter_truth::picture(&path));
    }
}

#[test]
fn white_things_vanish_in_a_white_furnace_whatever_the_exposure() {
    // 128 in sRGB, so that a step of the picture is a visible step of light.
    let gray = f64::from(Color::srgb_u8(128, 128, 128).to_linear().red);
    let Some((mut app, camera, picture)) = lit_app(cube(32, |_| DVec3::splat(gray))) else { return };
    let ball = app.world_mut().resource_mut::<Assets<Mesh>>().add(Sphere::new(0.5).mesh().ico(8).expect("few enough"));
    for (x, metallic, perceptual_roughness) in [(-0.55, 1.0, 0.1), (0.55, 1.0, 0.7), (0.0, 0.0, 0.9)] {
        let white = StandardMaterial { base_color: Color::WHITE, metallic, perceptual_roughness, ..default() };
        let white = app.world_mut().resource_mut::<Assets<StandardMaterial>>().add(white);
        app.world_mut().spawn((Mesh3d(ball.clone()), MeshMaterial3d(white), Transform::from_xyz(x, 0.0, 0.0)));
    }
    // A white background, to see that there is something at all.
    app.world_mut().get_mut::<Camera>(camera).expect("it is a camera").clear_color = Color::WHITE.into();
    for ev100 in [Exposure::default().ev100, 3.0] {
        app.world_mut().entity_mut(camera).insert(Exposure { ev100 });
        app.update();
        app.update();
        let shown = headless::read_texture(&mut app, &picture).expect("the picture comes back");
        let row = |x: usize| shown[4 * (96 * 32 + x)..][..3].to_vec();
        assert_eq!(row(1), [255; 3], "background");
        let middle: Vec<u8> = (14..82).flat_map(row).collect();
        let (low, high) = (middle.iter().min(), middle.iter().max());
        println!("furnace at EV {ev100}: balls show {low:?}…{high:?}, expected 128");
        assert!(middle.iter().all(|v| v.abs_diff(128) <= RENDERED_TOLERANCE));
    }
}
