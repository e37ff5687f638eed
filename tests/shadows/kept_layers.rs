//! Layers of a `StandardMaterial` on image-based surfaces under a dome: where nothing casts, these look as the
//! engine's do without a dome.

use crate::studio::{EXTENT, Picture, RADIUS, Studio, ball_mesh, checkers, normals};
use bevy::{light::NotShadowCaster, prelude::*};
use bevy_mirrorball::prelude::*;

/// Rounding of normals that a prepass kept in ten bits.
const ROUNDING: u8 = 3;

/// The ball under a sky of two colors.
fn under_sky(material: StandardMaterial, style: SurfaceStyle) -> Option<Studio> {
    let mut studio = Studio::new(SurfaceStyle::ImageBased)?;
    studio.add_sky(Vec3::new(0.6, 0.64, 0.48), Vec3::new(0.05, 0.1, 0.2), Vec3::new(0.9, 0.7, 0.5));
    studio.set_ball(material, style);
    Some(studio)
}

fn add_dome(studio: &mut Studio) {
    let few = ShadowDomeLight { directions: 16, resolution: 64, surfels: 0, ..default() };
    studio.app.world_mut().spawn(ShadowDomeLight { occludes_reflections: true, ..few });
}

fn red() -> StandardMaterial {
    StandardMaterial { base_color: Color::linear_rgb(0.5, 0.03, 0.02), perceptual_roughness: 0.8, ..default() }
}

fn brass() -> StandardMaterial {
    StandardMaterial {
        base_color: Color::linear_rgb(0.9, 0.7, 0.3),
        metallic: 1.0,
        perceptual_roughness: 0.5,
        ..default()
    }
}

fn materials(images: &mut Assets<Image>) -> [(&'static str, StandardMaterial); 8] {
    let bumps = images.add(checkers([200, 128, 230, 255], [100, 60, 220, 255]));
    let heights = images.add(checkers([0; 4], [255; 4]));
    let colors = images.add(checkers([255, 200, 0, 255], [0, 40, 90, 255]));
    let coated = StandardMaterial { clearcoat: 1.0, clearcoat_perceptual_roughness: 0.05, ..red() };
    let parallax = StandardMaterial {
        depth_map: Some(heights),
        base_color_texture: Some(colors),
        parallax_depth_scale: 0.05,
        ..red()
    };
    let glass = StandardMaterial {
        specular_transmission: 1.0,
        ior: 1.5,
        thickness: RADIUS,
        perceptual_roughness: 0.0,
        ..Color::WHITE.into()
    };
    let embossed = StandardMaterial { normal_map_texture: Some(bumps.clone()), ..brass() };
    [
        ("clear coat", coated.clone()),
        ("clear coat on a normal map", StandardMaterial { normal_map_texture: Some(bumps.clone()), ..coated }),
        ("brass", brass()),
        ("normal map", embossed),
        ("parallax map", parallax),
        ("diffuse transmission", StandardMaterial { diffuse_transmission: 0.8, thickness: 0.1, ..red() }),
        (
            "frosted glass",
            StandardMaterial { perceptual_roughness: 0.4, normal_map_texture: Some(bumps), ..glass.clone() },
        ),
        ("glass", glass),
    ]
}

/// Pictures of all materials before a checkered wall, for what they let through.
fn shoot_materials(studio: &mut Studio, style: SurfaceStyle) -> Vec<(&'static str, Picture)> {
    let mut images = studio.app.world_mut().resource_mut::<Assets<Image>>();
    let checkers = images.add(checkers([255, 200, 0, 255], [0, 40, 90, 255]));
    let materials = materials(&mut images);
    let wall = StandardMaterial { base_color_texture: Some(checkers), unlit: true, ..default() };
    let behind = Transform::from_xyz(0.0, 0.0, -1.0);
    studio.add(Rectangle::new(2.0 * EXTENT, 2.0 * EXTENT), wall, (NotShadowCaster, behind));
    studio.app.world_mut().entity_mut(studio.ball).insert(Visibility::Hidden);
    let shots = materials.map(|(what, material)| {
        let mesh = ball_mesh().with_generated_tangents().expect("has coordinates of textures");
        let thing = studio.add(mesh, material, (NotShadowCaster, style));
        let picture = studio.shoot();
        studio.app.world_mut().despawn(thing);
        (what, picture)
    });
    shots.into()
}

#[test]
fn coats_maps_and_transmission_are_the_engines() {
    let Some(mut engine) = under_sky(Color::WHITE.into(), SurfaceStyle::Engine) else { return };
    let expected = shoot_materials(&mut engine, SurfaceStyle::Engine);
    let Some(mut studio) = under_sky(Color::WHITE.into(), SurfaceStyle::Engine) else { return };
    add_dome(&mut studio);
    let found = shoot_materials(&mut studio, SurfaceStyle::ImageBased);
    for ((what, expected), (_, found)) in expected.iter().zip(&found) {
        let difference = found.difference(expected);
        let colors: Vec<Vec3> = normals().map(|(pixel, _)| expected.linear(pixel)).collect();
        let [darkest, brightest] = [Vec3::min, Vec3::max].map(|pick| colors.iter().copied().fold(colors[0], pick));
        let varies = (brightest - darkest).max_element();
        println!("{what}: off by {difference}, varies by {varies}");
        assert!(difference <= ROUNDING && varies > 0.05, "{what}: {difference}, {varies}");
    }
}

#[test]
fn what_stands_beside_a_coat_takes_from_its_reflection() {
    let coat = StandardMaterial {
        clearcoat: 1.0,
        clearcoat_perceptual_roughness: 0.1,
        reflectance: 0.0,
        ..Color::BLACK.into()
    };
    let Some(mut studio) = under_sky(coat, SurfaceStyle::ImageBased) else { return };
    add_dome(&mut studio);
    // The caches of the dome fill.
    let shoot = |studio: &mut Studio| {
        for _ in 0..4 {
            studio.shoot();
        }
        studio.shoot()
    };
    let alone = shoot(&mut studio);
    let wall = Cuboid::new(0.2, 4.0, 4.0);
    studio.add(wall, Color::BLACK, Transform::from_xyz(-EXTENT - 0.15, 0.0, 0.0));
    let beside = shoot(&mut studio);
    let light_on = |picture: &Picture, side: f32| -> f32 {
        let pixels = normals().filter(|(_, normal)| normal.x * side > 0.4);
        pixels.map(|(pixel, _)| picture.linear(pixel).element_sum()).sum()
    };
    let [near, far] = [-1.0, 1.0].map(|side| light_on(&beside, side) / light_on(&alone, side));
    println!("{near:.2} of the reflection is left beside the wall, {far:.2} on the other side");
    assert!(near < 0.7 && far > 0.95);
}

#[test]
fn without_tangents_anisotropic_surfaces_are_isotropic() {
    let Some(mut studio) = under_sky(brass(), SurfaceStyle::ImageBased) else { return };
    add_dome(&mut studio);
    let isotropic = studio.shoot();
    studio.set_ball(StandardMaterial { anisotropy_strength: 0.9, ..brass() }, SurfaceStyle::ImageBased);
    let difference = studio.shoot().difference(&isotropic);
    println!("off by {difference}");
    assert_eq!(difference, 0);
}
