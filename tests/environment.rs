//! Filtered environments against double precision sums on the CPU, and white things in a white furnace.

mod cubes;
mod gpu;

use bevy::{
    asset::RenderAssetUsages,
    camera::Exposure,
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    image::ImageSampler,
    light::EnvironmentMapLight,
    math::DVec3,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension},
};
use bevy_mirrorball::{
    environment::{CubePixels, EnvironmentPlugin, FilteredEnvironment, LiveEnvironment},
    offscreen,
};

/// Half floats have 11 significant bits; sums of thousands of them in single precision stay within a few such steps.
const FURNACE_TOLERANCE: f64 = 1e-3;
/// The cosine's kink at the horizon cuts through blocks 5.6° wide, which count as one direction each; and half floats.
const SMOOTH_TOLERANCE: f64 = 2e-3;
/// What a viewer could see in a slow gradient next to a correct one is 1 %; half of that.
const SUNS_RMSE: f64 = 5e-3;
/// Rounding of the picture to 8 bits, and one step for the engine's own table of GGX albedo (11 bits in half floats).
const RENDERED_TOLERANCE: u8 = 1;

/// World direction of the center of texel `i` of a cube, and its solid angle by Gauss–Bonnet.
fn texel(edge: usize, i: usize) -> (DVec3, f64) {
    let (face, row, column) = (i / (edge * edge), i / edge % edge, i % edge);
    let at = |k: f64| 2.0 * k / edge as f64 - 1.0;
    let (x, y) = (at(column as f64 + 0.5), at(row as f64 + 0.5));
    // Layers +X, −X, +Y, −Y, +Z, −Z of a left-handed frame: the world's z is the negative.
    let dir = match face {
        0 => DVec3::new(1.0, -y, -x),
        1 => DVec3::new(-1.0, -y, x),
        2 => DVec3::new(x, 1.0, y),
        3 => DVec3::new(x, -1.0, -y),
        4 => DVec3::new(x, -y, 1.0),
        _ => DVec3::new(-x, -y, -1.0),
    };
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    let (left, right) = (at(column as f64), at(column as f64 + 1.0));
    let (top, bottom) = (at(row as f64), at(row as f64 + 1.0));
    let solid_angle = corner(right, bottom) + corner(left, top) - corner(left, bottom) - corner(right, top);
    (dir.normalize() * DVec3::new(1.0, 1.0, -1.0), solid_angle)
}

fn cube(edge: usize, radiance: impl Fn(DVec3) -> DVec3) -> Image {
    let texels = (0..6 * edge * edge).flat_map(|i| {
        let l = radiance(texel(edge, i).0);
        [l.x, l.y, l.z, 1.0].into_iter().flat_map(|v| half::f16::from_f64(v).to_le_bytes())
    });
    let extent = Extent3d { width: edge as u32, height: edge as u32, depth_or_array_layers: 6 };
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new(extent, TextureDimension::D2, texels.collect(), format, RenderAssetUsages::RENDER_WORLD);
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    image.sampler = ImageSampler::linear();
    image
}

/// An app with one plain camera under an environment, and the picture it renders into.
fn lit_app(source: Image) -> Option<(App, Entity, Handle<Image>)> {
    let mut app = gpu::app(|app| {
        app.add_plugins(EnvironmentPlugin);
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
    app.update();
    app.update();
    Some((app, camera, picture))
}

fn diffuse_and_glossy(app: &mut App, camera: Entity) -> (CubePixels, CubePixels) {
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    (cubes::read(app, &maps.diffuse), cubes::read(app, &maps.glossy))
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
    assert!(diffuse <= SMOOTH_TOLERANCE && glossy <= SMOOTH_TOLERANCE);
}

#[test]
fn suns_of_very_different_strength_keep_their_energy_and_place() {
    const EDGE: usize = 64;
    let (strong, weak) = (DVec3::new(0.3, 0.8, -0.4).normalize(), DVec3::new(-0.7, 0.2, 0.6).normalize());
    // Half-float values, so that the reference sums exactly what the GPU was given.
    let radiance = |dir: DVec3| {
        let strong = if dir.dot(strong) > 2f64.to_radians().cos() { 1e4 } else { 0.0 };
        let weak = if dir.dot(weak) > 15f64.to_radians().cos() { 1.0 } else { 0.0 };
        DVec3::new(strong, weak, strong.max(weak)).map(|v| half::f16::from_f64(v + 0.03125).to_f64())
    };
    let Some((mut app, camera, _)) = lit_app(cube(EDGE, radiance)) else { return };
    let (diffuse, _) = diffuse_and_glossy(&mut app, camera);
    let lights: Vec<(DVec3, DVec3)> = (0..6 * EDGE * EDGE)
        .map(|i| texel(EDGE, i))
        .map(|(dir, solid_angle)| (dir, radiance(dir) * solid_angle / std::f64::consts::PI))
        .collect();
    let (mut errors, mut signal) = (DVec3::ZERO, DVec3::ZERO);
    for (i, got) in diffuse.texels.iter().enumerate() {
        let normal = texel(diffuse.edge as usize, i).0;
        let expected: DVec3 = lights.iter().map(|(dir, light)| light * normal.dot(*dir).max(0.0)).sum();
        errors += (got.as_dvec3() - expected).map(|e| e * e);
        signal += expected * expected;
    }
    let rmse = (errors / signal).map(f64::sqrt);
    println!(
        "suns: relative RMSE {:.3} % (strong), {:.3} % (weak), {:.3} % (both)",
        1e2 * rmse.x,
        1e2 * rmse.y,
        1e2 * rmse.z
    );
    assert!(rmse.max_element() <= SUNS_RMSE);
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
    let later = [cube(24, |_| DVec3::ONE), cube(32, |_| DVec3::splat(3.0)), cube(16, |_| DVec3::splat(0.25))];
    for (source, expected) in later.into_iter().zip([None, Some(3.0), Some(0.25)]) {
        let source = app.world_mut().resource_mut::<Assets<Image>>().add(source);
        app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(source));
        app.update();
        app.update();
        assert_eq!(is_lit(&app), expected.is_some(), "expected {expected:?}");
        if let Some(expected) = expected {
            let (diffuse, _) = diffuse_and_glossy(&mut app, camera);
            assert!(worst_error(&diffuse, |_| DVec3::splat(expected)) <= FURNACE_TOLERANCE);
        }
    }
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(Handle::default()));
    app.update();
    assert!(!is_lit(&app), "no image");
}
