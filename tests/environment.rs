//! Filtered environments against double precision sums on the CPU, and white things in a white furnace.

mod cubes;
mod filter_truth;
mod gpu;
mod shared_data;

use bevy::{
    asset::RenderAssetUsages,
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    light::{EnvironmentMapLight, GeneratedEnvironmentMapLight},
    math::DVec3,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{
    environment_map::CubePixels,
    offscreen,
    prefilter::{DeskParallax, EnvironmentState, FilteredEnvironment, LiveEnvironment, PrefilterPlugin, Refresh},
};
use filter_truth::{ROUGHNESSES, Truth, brightest, relative_rmse, seam, texel};

/// Half floats have 11 significant bits; sums of thousands of them in single precision stay within a few such steps.
const FURNACE_TOLERANCE: f64 = 1e-3;
/// Half floats, and texels of a slope.
const SMOOTH_TOLERANCE: f64 = 2e-3;
/// The cosine's kink at the horizon cuts through blocks 11° wide, which count as evenly spread disks: the largest error of all.
const HORIZON_TOLERANCE: f64 = 8e-3;
/// What a viewer could see in a slow gradient next to a correct one is 1 %; half of that.
const DIFFUSE_RMSE: f64 = 5e-3;
/// As much as rounding to 8 bits does to a mid gray; or half of what the engine's own filter is off, where that is more.
const GLOSSY_RMSE: f64 = 1e-2;
/// Steps across cube edges relative to those the environment itself makes there.
const SEAM_GROWTH: f64 = 1.5;
/// Brightest value relative to the brightest true one: no fireflies.
const MAX_PEAK: f64 = 1.05;
/// Rounding of the picture to 8 bits, and one step for the engine's own table of GGX albedo (11 bits in half floats).
const RENDERED_TOLERANCE: u8 = 1;

/// To wait for shaders and filters.
const PATIENCE: std::time::Duration = std::time::Duration::from_secs(120);

fn cube(edge: usize, radiance: impl Fn(DVec3) -> DVec3) -> Image {
    filter_truth::cube(edge, &filter_truth::texels(edge, radiance))
}

/// An app with one plain camera under an environment, and the picture it renders into.
fn lit_app(source: Image) -> Option<(App, Entity, Handle<Image>)> {
    let mut app = gpu::app(|app| {
        app.add_plugins(PrefilterPlugin);
    })?;
    let source = app.world_mut().resource_mut::<Assets<Image>>().add(source);
    let (picture, target) = offscreen::add_target(&mut app, UVec2::new(96, 64));
    let camera = (
        Camera3d::default(),
        Transform::from_xyz(0.0, 0.0, 2.0),
        Tonemapping::None,
        DebandDither::Disabled,
        AmbientLight { brightness: 0.0, ..default() },
        LiveEnvironment::new(source),
        target,
    );
    let camera = app.world_mut().spawn(camera).id();
    // Shaders are loaded in the background, which takes its time on a busy machine.
    offscreen::update_until(&mut app, "filtering the environment", PATIENCE, |app| {
        let state = app.world().get::<EnvironmentState>(camera);
        !matches!(state, Some(EnvironmentState::Live { refreshes: 0, .. } | EnvironmentState::Waiting))
    })
    .expect("it is filtered or refused");
    Some((app, camera, picture))
}

fn diffuse_and_glossy(app: &mut App, camera: Entity) -> (CubePixels, CubePixels) {
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    (cubes::read(app, &maps.diffuse), cubes::read(app, &maps.specular))
}

/// Largest relative difference between a cube and a function of direction, over all texels and channels.
fn worst_error(cube: &CubePixels, expected: impl Fn(DVec3) -> DVec3) -> f64 {
    let errors = cube.texels.iter().enumerate().map(|(i, got)| {
        let expected = expected(texel(cube.edge as usize, i).0);
        ((got.as_dvec3() - expected) / expected).abs().max_element()
    });
    errors.fold(0.0, f64::max)
}

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
    let source = filter_truth::texels(edge, radiance);
    let Some((mut app, camera, _)) = lit_app(filter_truth::cube(edge, &source)) else { return };
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    let environment_map = maps_source(&app, camera);
    let bevy = app.world_mut().spawn(GeneratedEnvironmentMapLight { environment_map, ..default() }).id();
    for _ in 0..4 {
        app.update();
    }
    let bevy = app.world().get::<EnvironmentMapLight>(bevy).expect("Bevy takes the cube").clone();
    let ours = filter_truth::read(&mut app, &maps.diffuse, &maps.specular, DIRECTIONS);
    let bevy = filter_truth::read(&mut app, &bevy.diffuse_map, &bevy.specular_map, DIRECTIONS);
    let truth = Truth::of(edge, &source, DIRECTIONS);
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

fn maps_source(app: &App, camera: Entity) -> Handle<Image> {
    app.world().get::<LiveEnvironment>(camera).expect("it has one").source.clone()
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
        let shown = offscreen::read_texture(&mut app, &picture).expect("the picture comes back");
        let row = |x: usize| shown[4 * (96 * 32 + x)..][..3].to_vec();
        assert_eq!(row(1), [255; 3], "background");
        let middle: Vec<u8> = (14..82).flat_map(row).collect();
        let (low, high) = (middle.iter().min(), middle.iter().max());
        println!("furnace at EV {ev100}: balls show {low:?}…{high:?}, expected 128");
        assert!(middle.iter().all(|v| v.abs_diff(128) <= RENDERED_TOLERANCE));
    }
}

#[test]
fn what_is_no_cube_is_refused_and_a_cube_given_later_is_taken() {
    let flat = Image::new_fill(
        Extent3d { width: 64, height: 64, depth_or_array_layers: 1 },
        TextureDimension::D2,
        &[0; 8],
        TextureFormat::Rgba16Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    let Some((mut app, camera, _)) = lit_app(flat) else { return };
    let is_lit = |app: &App| {
        let camera = app.world().entity(camera);
        camera.contains::<EnvironmentMapLight>() || camera.contains::<FilteredEnvironment>()
    };
    assert!(!is_lit(&app), "one layer");
    let state = app.world().get::<EnvironmentState>(camera);
    assert!(
        matches!(state, Some(EnvironmentState::Refused(why)) if why.contains("64 × 64 with 1 layers")),
        "{state:?}"
    );
    let later = [cube(24, |_| DVec3::ONE), cube(32, |_| DVec3::splat(3.0)), cube(16, |_| DVec3::splat(0.25))];
    for (source, expected) in later.into_iter().zip([1.0, 3.0, 0.25]) {
        let source = app.world_mut().resource_mut::<Assets<Image>>().add(source);
        app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source));
        app.update();
        app.update();
        assert!(is_lit(&app), "expected {expected}");
        let (diffuse, _) = diffuse_and_glossy(&mut app, camera);
        assert!(worst_error(&diffuse, |_| DVec3::splat(expected)) <= FURNACE_TOLERANCE);
    }
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(Handle::default()));
    app.update();
    assert!(!is_lit(&app), "no image");
    // Bevy's default image is one white pixel.
    let state = app.world().get::<EnvironmentState>(camera);
    assert!(matches!(state, Some(EnvironmentState::Refused(why)) if why.contains("1 × 1")), "{state:?}");
    let coming = app.world().resource::<Assets<Image>>().reserve_handle();
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(coming));
    app.update();
    assert_eq!(app.world().get::<EnvironmentState>(camera), Some(&EnvironmentState::Waiting));
}

/// A light that the maps hold, by its color: the GPU's answer to what was last uploaded.
fn shown(app: &mut App, camera: Entity) -> f32 {
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("is lit").clone();
    cubes::read(app, &maps.diffuse).texels[0].x
}

fn refreshes(app: &App, camera: Entity) -> u32 {
    match app.world().get::<EnvironmentState>(camera) {
        Some(EnvironmentState::Live { refreshes, .. }) => *refreshes,
        other => panic!("not live: {other:?}"),
    }
}

#[test]
fn what_does_not_change_is_not_filtered_again() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source.clone()).with_refresh(Refresh::OnChange));
    for _ in 0..6 {
        app.update();
    }
    let settled = refreshes(&app, camera);
    for _ in 0..5 {
        app.update();
    }
    assert!(settled > 0 && refreshes(&app, camera) == settled);
    let brighter = cube(16, |_| DVec3::splat(2.0));
    app.world_mut().resource_mut::<Assets<Image>>().insert(&source, brighter).expect("same handle");
    for _ in 0..3 {
        app.update();
    }
    assert!(refreshes(&app, camera) > settled);
    assert!((shown(&mut app, camera) - 2.0).abs() < 2e-3);
}

#[test]
fn a_budget_shows_whole_sets_only() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    let budget = Refresh::Budget { dispatches: 1 };
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source).with_refresh(budget));
    for _ in 0..3 {
        app.update();
    }
    let before = refreshes(&app, camera);
    // Reading, the diffuse map and levels 1 and 2 (8 and 4 texels wide) are four dispatches.
    for _ in 0..12 {
        app.update();
    }
    assert_eq!(refreshes(&app, camera) - before, 3);
    assert!((shown(&mut app, camera) - 1.0).abs() < 2e-3);
}

#[test]
fn an_equirectangular_picture_lights_from_where_it_shows_light() {
    let width = 64;
    let bytes = (0..width * width / 2).flat_map(|i| {
        let uv =
            Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, width as f32 / 2.0);
        let dir = bevy_mirrorball::environment_map::equirect_direction(uv).as_dvec3();
        let light = 1.0 + 0.8 * dir;
        [light.x, light.y, light.z, 1.0].into_iter().flat_map(|v| (v as f32).to_le_bytes())
    });
    let picture = Image::new(
        Extent3d { width, height: width / 2, depth_or_array_layers: 1 },
        TextureDimension::D2,
        bytes.collect(),
        TextureFormat::Rgba32Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    let Some((mut app, camera, _)) = lit_app(picture) else { return };
    let (diffuse, _) = diffuse_and_glossy(&mut app, camera);
    let error = worst_error(&diffuse, |normal| 1.0 + 0.8 * 2.0 / 3.0 * normal);
    println!("equirectangular: diffuse off by {error:.1e}");
    // Bilinear interpolation over 5.6° of the picture.
    assert!(error <= 1e-2);
}

#[test]
fn what_another_camera_renders_lights_at_once() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let (picture, target) = offscreen::add_target(&mut app, UVec2::new(64, 32));
    let first = Camera { order: -1, ..default() };
    let other = app.world_mut().spawn((Camera3d::default(), first, Tonemapping::None, Msaa::Off, target)).id();
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(picture));
    for gray in [0.2, 0.6] {
        app.world_mut().get_mut::<Camera>(other).expect("a camera").clear_color =
            Color::linear_rgb(gray, gray, gray).into();
        for _ in 0..4 {
            app.update();
        }
        let light = shown(&mut app, camera);
        println!("a target of {gray} gives light of {light}");
        // 8 bits, sRGB-encoded.
        assert!((light - gray).abs() < 0.005);
    }
}

#[test]
fn light_goes_with_its_component_and_maps_of_one_source_are_shared() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let environment = app.world().get::<LiveEnvironment>(camera).expect("it has one").clone();
    let probe = app.world_mut().spawn((LightProbe::default(), environment)).id();
    app.update();
    let glossy = |app: &App, entity| app.world().get::<FilteredEnvironment>(entity).expect("is lit").specular.clone();
    assert_eq!(glossy(&app, camera), glossy(&app, probe));
    app.world_mut().entity_mut(probe).remove::<LiveEnvironment>();
    app.update();
    assert!(!app.world().entity(probe).contains::<EnvironmentMapLight>());
    assert!(app.world().entity(camera).contains::<EnvironmentMapLight>());
}

/// A desk with a pattern, and a gray sky, seen from a place above it.
fn desk_from(eye: Vec3, dir: DVec3) -> DVec3 {
    if dir.y >= 0.0 {
        return DVec3::splat(0.5);
    }
    let place = eye.as_dvec3() - dir * (f64::from(eye.y) / dir.y);
    // Flat far away, where texels are wide.
    DVec3::new(1.0 + (8.0 * place.x).tanh(), 1.0 + (8.0 * place.z).tanh(), 1.0)
}

#[test]
fn a_probe_beside_the_ball_mirrors_the_desk_that_is_under_it() {
    let (ball, eye) = (Vec3::new(0.1, 0.15, 0.0), Vec3::new(0.4, 0.1, 0.2));
    let Some((mut app, camera, _)) = lit_app(cube(128, |dir| desk_from(ball, dir))) else { return };
    let environment = LiveEnvironment::new(maps_source(&app, camera)).with_refresh(Refresh::OnChange);
    let parallax = DeskParallax { captured_from: ball, height: 0.0 };
    let start = Transform::from_translation(ball);
    let probe = app.world_mut().spawn((LightProbe::default(), environment, parallax, start)).id();
    let error = |app: &mut App, probe: Entity, from: Vec3| {
        let (_, glossy) = diffuse_and_glossy(app, probe);
        let errors = glossy.texels.iter().enumerate().filter_map(|(i, got)| {
            let dir = texel(128, i).0;
            (dir.y < -0.4).then(|| got.as_dvec3().distance(desk_from(from, dir)))
        });
        errors.fold(0.0, f64::max)
    };
    for _ in 0..4 {
        app.update();
    }
    let at_ball = error(&mut app, probe, ball);
    let before = error(&mut app, probe, eye);
    app.world_mut().get_mut::<Transform>(probe).expect("it is somewhere").translation = eye;
    for _ in 0..3 {
        app.update();
    }
    let after = error(&mut app, probe, eye);
    println!("desk from the ball off by {at_ball:.3}, from beside it by {after:.3}, without parallax by {before:.3}");
    // Four lookups across a texel 0.7° wide.
    assert!(at_ball < 0.01 && after < 0.01 && before > 0.5);
}

#[test]
fn light_probes_follow_the_exposure_of_the_camera_that_looks() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let environment = LiveEnvironment::new(maps_source(&app, camera));
    let probe = app.world_mut().spawn((LightProbe::default(), environment)).id();
    app.world_mut().entity_mut(camera).insert(Exposure { ev100: 3.0 });
    app.update();
    app.update();
    let intensity = |app: &App, entity| app.world().get::<EnvironmentMapLight>(entity).expect("is lit").intensity;
    assert_eq!(intensity(&app, probe), 1.0 / Exposure { ev100: 3.0 }.exposure());
    assert_eq!(intensity(&app, probe), intensity(&app, camera));
    app.world_mut().entity_mut(probe).insert(Exposure { ev100: 5.0 });
    app.update();
    assert_eq!(intensity(&app, probe), 1.0 / Exposure { ev100: 5.0 }.exposure(), "its own");
}

#[test]
fn what_is_refreshed_on_request_waits_for_it() {
    let Some((mut app, camera, _)) = lit_app(cube(16, |_| DVec3::ONE)) else { return };
    let source = maps_source(&app, camera);
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source.clone()).with_refresh(Refresh::OnRequest));
    for _ in 0..4 {
        app.update();
    }
    let settled = refreshes(&app, camera);
    let mut images = app.world_mut().resource_mut::<Assets<Image>>();
    let bytes = cube(16, |_| DVec3::splat(2.0)).data;
    let texture = images.get_mut(&source).map(|mut image| image.data = bytes);
    assert!(settled == 1 && texture.is_some());
    for _ in 0..3 {
        app.update();
    }
    app.world().get::<FilteredEnvironment>(camera).expect("is lit").request_refresh();
    for _ in 0..3 {
        app.update();
    }
    assert!(refreshes(&app, camera) > settled);
    assert!((shown(&mut app, camera) - 2.0).abs() < 2e-3);
}
