//! Sources of environments: cubes, equirectangular images and renders; other images are refused.

use super::{FURNACE_TOLERANCE, cube, diffuse_and_glossy, lit_app, shown, worst_error};
use bevy::{
    asset::RenderAssetUsages,
    core_pipeline::tonemapping::Tonemapping,
    light::EnvironmentMapLight,
    math::DVec3,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{
    environment_map::equirect_direction,
    headless,
    prefilter::{EnvironmentState, FilteredEnvironment, LiveEnvironment},
};

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
    assert!(matches!(state, Some(EnvironmentState::Failed(why)) if why.contains("64 × 64 with 1 layers")), "{state:?}");
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
    assert!(matches!(state, Some(EnvironmentState::Failed(why)) if why.contains("1 × 1")), "{state:?}");
    let coming = app.world().resource::<Assets<Image>>().reserve_handle();
    app.world_mut().entity_mut(camera).insert(LiveEnvironment::new(coming));
    app.update();
    assert_eq!(app.world().get::<EnvironmentState>(camera), Some(&EnvironmentState::Waiting));
}

#[test]
fn an_equirectangular_picture_lights_from_where_it_shows_light() {
    let width = 64;
    let bytes = (0..width * width / 2).flat_map(|i| {
        let uv =
            Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5) / Vec2::new(width as f32, width as f32 / 2.0);
        let dir = equirect_direction(uv).as_dvec3();
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
    let (picture, target) = headless::add_target(&mut app, UVec2::new(64, 32));
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
