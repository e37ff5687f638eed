//! Outlines: width, corners and skinned meshes.

use crate::studio::{EXTENT, RADIUS, SIZE, Studio, on_a_bone, toon};
use bevy::{
    asset::RenderAssetUsages,
    image::ImageSampler,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::prelude::*;

#[test]
fn the_outline_is_a_ring_of_its_width() {
    let Some(mut studio) = Studio::new(toon(3)) else { return };
    let green = Color::linear_rgb(0.0, 1.0, 0.0);
    for wanted in [0, 2, 5, 0, 1] {
        studio.set_style(SurfaceStyle::Toon(ToonStyle {
            outline_width: wanted as f32,
            outline_color: green,
            ..default()
        }));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let widths = [0..SIZE.x / 2, SIZE.x / 2..SIZE.x].map(|columns| picture.outline_in_row(row, columns));
        let ring: usize = (0..SIZE.y).map(|row| picture.outline_in_row(row, 0..SIZE.x)).sum();
        let radius = RADIUS / EXTENT * 0.5 * SIZE.y as f32;
        let expected = std::f32::consts::PI * ((radius + wanted as f32).powi(2) - radius.powi(2));
        println!("{wanted} pixels wanted: {widths:?} at the sides, {ring} in all, expected {expected:.0}");
        // A pixel belongs to the ring or not; the ball is a polyhedron.
        assert!(widths.iter().all(|width| width.abs_diff(wanted) <= usize::from(wanted > 0)));
        assert!((ring as f32 - expected).abs() <= 0.15 * expected + 1.0);
    }
}

#[test]
fn the_outline_of_a_box_has_no_gaps_at_its_corners() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 4.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let turned = Transform::from_rotation(Quat::from_euler(EulerRot::YXZ, 0.6, 0.5, 0.2));
    studio.add(Cuboid::from_length(0.5), Color::WHITE, (SurfaceStyle::Toon(style), turned));
    let picture = studio.shoot();
    // Walking from the box outwards in any direction, one meets the outline before the background.
    for step in 0..180 {
        let dir = Vec2::from_angle(step as f32 * std::f32::consts::TAU / 180.0);
        let first_outside = (0..SIZE.x / 2)
            .map(|t| picture.linear((0.5 * SIZE.as_vec2() + dir * t as f32).as_uvec2()))
            .find(|color| color.y > 0.9 || color.z > 0.4);
        assert!(first_outside.is_some_and(|color| color.y > 0.9), "a gap at {}°", 2 * step);
    }
}

#[test]
fn the_outline_follows_bones() {
    const SHIFT: f32 = 0.3;
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let style = ToonStyle { outline_width: 3.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let small = Sphere::new(0.2).mesh().ico(12).expect("few enough");
    let (bone, skin) = studio.add_bone(Transform::default());
    studio.add(on_a_bone(small), Color::WHITE, (SurfaceStyle::Toon(style), skin));
    let mut edges = Vec::new();
    for shift in [0.0, SHIFT] {
        studio.app.world_mut().entity_mut(bone).insert(Transform::from_xyz(shift, 0.0, 0.0));
        let picture = studio.shoot();
        let row = SIZE.y / 2;
        let ring: Vec<u32> = (0..SIZE.x).filter(|x| picture.outline_in_row(row, *x..*x + 1) == 1).collect();
        println!("shifted by {shift} m: outline at {ring:?}");
        assert_eq!(ring.len(), 6);
        edges.push(ring);
    }
    let moved = (SHIFT / EXTENT * 0.5 * SIZE.y as f32) as u32;
    assert!(edges[0].iter().zip(&edges[1]).all(|(before, after)| after - before == moved));
}

#[test]
fn an_outline_in_meters_is_thinner_with_distance() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    let outline_color = Color::linear_rgb(0.0, 1.0, 0.0);
    let style = |outline_width, outline_meters| {
        SurfaceStyle::Toon(ToonStyle { outline_width, outline_meters, outline_color, ..default() })
    };
    let small = || Sphere::new(0.1).mesh().ico(16).expect("few enough");
    let ball = studio.add(small(), Color::WHITE, (style(0.0, 0.05), Transform::default()));
    let mut ring = |distance: f32, style: SurfaceStyle| {
        let projection = PerspectiveProjection { fov: 0.6, aspect_ratio: 1.0, ..default() };
        let world = studio.app.world_mut();
        let camera = (Projection::Perspective(projection), Transform::from_xyz(0.0, 0.0, distance));
        world.entity_mut(studio.camera).insert(camera);
        world.entity_mut(ball).insert(style);
        let picture = studio.shoot();
        picture.outline_in_row(SIZE.y / 2, 0..SIZE.x / 2) as f32
    };
    let pixels_at = |distance: f32| 0.05 / (distance * 0.3_f32.tan()) * 0.5 * SIZE.y as f32;
    for distance in [0.6, 1.2, 2.4] {
        let (found, expected) = (ring(distance, style(0.0, 0.05)), pixels_at(distance));
        println!("{distance} m away: {found} pixels, expected {expected:.1}");
        // The silhouette of a near ball is a little larger than its radius.
        assert!((found - expected).abs() <= 1.0 + 0.15 * expected);
        assert!((ring(distance, style(3.0, 0.0)) - 3.0).abs() <= 1.0);
        assert!((ring(distance, style(3.0, 0.05)) - found - 3.0).abs() <= 1.0, "widths add up");
    }
}

#[test]
fn the_outline_of_a_masked_surface_has_its_holes() {
    const EDGE: u32 = 64;
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    studio.app.world_mut().despawn(studio.ball);
    // The left half is cut out.
    let texels = (0..EDGE * EDGE).flat_map(|i| [255, 255, 255, if i % EDGE < EDGE / 2 { 0 } else { 255 }]).collect();
    let extent = Extent3d { width: EDGE, height: EDGE, depth_or_array_layers: 1 };
    let (format, usage) = (TextureFormat::Rgba8Unorm, RenderAssetUsages::default());
    let mut half = Image::new(extent, TextureDimension::D2, texels, format, usage);
    half.sampler = ImageSampler::nearest();
    let half = studio.app.world_mut().resource_mut::<Assets<Image>>().add(half);
    let style = ToonStyle { outline_width: 5.0, outline_color: Color::linear_rgb(0.0, 1.0, 0.0), ..default() };
    let material =
        StandardMaterial { base_color_texture: Some(half), alpha_mode: AlphaMode::Mask(0.5), ..Color::WHITE.into() };
    let faded = StandardMaterial { alpha_mode: AlphaMode::Blend, ..material.clone() };
    let invisible =
        StandardMaterial { base_color: Color::WHITE.with_alpha(0.2), base_color_texture: None, ..material.clone() };
    let mut outline = |material: StandardMaterial| {
        let cube = studio.add(Cuboid::from_length(0.6), material, SurfaceStyle::Toon(style));
        let picture = studio.shoot();
        studio.app.world_mut().despawn(cube);
        let row = SIZE.y / 2;
        [0..SIZE.x / 2, SIZE.x / 2..SIZE.x].map(|columns| picture.outline_in_row(row, columns))
    };
    // The far face of a cube has its texture mirrored; the left side of the picture is the right half of that.
    let found = [outline(Color::WHITE.into()), outline(material), outline(faded), outline(invisible)];
    println!("outlines left and right, of an opaque, a masked, a blended and an invisible box: {found:?}");
    assert!(found[0].iter().all(|width| width.abs_diff(5) <= 1));
    assert!(found[1].contains(&0) && found[1].iter().any(|width| *width >= 4));
    assert_eq!(found[2..], [[0, 0], [0, 0]]);
}
