//! What a `StandardMaterial` and a mesh have, on matte classic surfaces: these look as the engine's do that reflect
//! nothing.

use super::twin::{sharp, studio};
use crate::studio::{RADIUS, Studio, ball_mesh, checkers, normals, on_a_bone};
use bevy::{prelude::*, render::render_resource::Face};
use bevy_mirrorball::prelude::*;

/// Rounding of sums in another order.
const ROUNDING: u8 = 1;

const MATTE: ClassicModel =
    ClassicModel::Combined(CombinedModel { ambient: 0.0, diffuse: 1.0, specular: 0.0, reflection: 0.0, exponent: 0.0 });

fn matte() -> StandardMaterial {
    StandardMaterial { reflectance: 0.0, ..Color::WHITE.into() }
}

/// Asserts that a thing looks the same in both styles, and not as a plain white ball.
fn assert_same(studio: &mut Studio, what: &str, mesh: Mesh, material: StandardMaterial, extra: impl Bundle) {
    let plain = studio.shoot();
    studio.app.world_mut().entity_mut(studio.ball).insert(Visibility::Hidden);
    let thing = studio.add(mesh, material, (extra, SurfaceStyle::Engine));
    let engine = studio.shoot();
    studio.app.world_mut().entity_mut(thing).insert(SurfaceStyle::Classic(sharp(MATTE)));
    let classic = studio.shoot();
    studio.app.world_mut().despawn(thing);
    studio.app.world_mut().entity_mut(studio.ball).insert(Visibility::Inherited);
    let (difference, change) = (classic.difference(&engine), classic.difference(&plain));
    println!("{what}: off by {difference}, {change} from a white ball");
    assert!(difference <= ROUNDING && change > 20, "{what}: {difference}, {change}");
}

#[test]
fn textures_alpha_and_flags_of_materials_are_kept() {
    let Some(mut studio) = studio(matte(), sharp(MATTE)) else { return };
    let mut images = studio.app.world_mut().resource_mut::<Assets<Image>>();
    let colors = images.add(checkers([255, 128, 0, 255], [0, 64, 255, 0]));
    let bumps = images.add(checkers([200, 128, 230, 255], [100, 60, 220, 255]));
    let cavities = images.add(checkers([255; 4], [80; 4]));
    let textured = StandardMaterial { base_color_texture: Some(colors), ..matte() };
    let faded = StandardMaterial { base_color: Color::linear_rgba(1.0, 1.0, 1.0, 0.5), ..matte() };
    let glowing = |weight| StandardMaterial {
        emissive: LinearRgba::rgb(0.0, 0.2, 0.3),
        emissive_exposure_weight: weight,
        ..matte()
    };
    let orange = Color::linear_rgb(0.8, 0.4, 0.0);
    let materials = [
        ("texture", textured.clone()),
        ("alpha mask", StandardMaterial { alpha_mode: AlphaMode::Mask(0.5), ..textured.clone() }),
        ("blended", StandardMaterial { alpha_mode: AlphaMode::Blend, ..faded.clone() }),
        ("premultiplied", StandardMaterial { alpha_mode: AlphaMode::Premultiplied, ..faded.clone() }),
        ("added", StandardMaterial { alpha_mode: AlphaMode::Add, ..faded }),
        ("normal map", StandardMaterial { normal_map_texture: Some(bumps), ..matte() }),
        ("occlusion", StandardMaterial { occlusion_texture: Some(cavities), ..matte() }),
        ("emissive", glowing(0.0)),
        ("unlit", StandardMaterial { unlit: true, base_color: orange, ..textured.clone() }),
        ("inside", StandardMaterial { cull_mode: Some(Face::Front), ..textured.clone() }),
        ("both sides", StandardMaterial { cull_mode: Some(Face::Front), double_sided: true, ..textured }),
    ];
    for (what, material) in materials {
        let mesh = ball_mesh().with_generated_tangents().expect("has coordinates of textures");
        assert_same(&mut studio, what, mesh, material, ());
    }
    let exposed = glowing(1.0);
    let bright = StandardMaterial { emissive: exposed.emissive * 1000.0, ..exposed };
    assert_same(&mut studio, "emissive under the camera's exposure", ball_mesh(), bright, ());
}

#[test]
fn vertex_colors_and_skins_of_meshes_are_kept() {
    let Some(mut studio) = studio(matte(), sharp(MATTE)) else { return };
    let count = ball_mesh().count_vertices();
    let colors: Vec<[f32; 4]> = (0..count).map(|i| if i % 2 == 0 { [1.0, 0.2, 0.2, 1.0] } else { [1.0; 4] }).collect();
    let colored = ball_mesh().with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors);
    assert_same(&mut studio, "vertex colors", colored, matte(), ());
    let (_, skin) = studio.add_bone(Transform::from_xyz(0.5 * RADIUS, 0.0, 0.0));
    assert_same(&mut studio, "a skin", on_a_bone(ball_mesh()), matte(), skin);
}

#[test]
fn a_white_ball_is_as_bright_as_in_the_other_styles() {
    let Some(mut studio) = studio(matte(), sharp(MATTE)) else { return };
    let classic = studio.shoot();
    let brightest = normals().map(|(pixel, _)| classic.linear(pixel).x).fold(0.0, f32::max);
    assert!(brightest > 0.5, "it is lit: {brightest}");
    studio.set_style(SurfaceStyle::Engine);
    let engine = studio.shoot();
    studio.app.world_mut().spawn(ShadowDomeLight { surfels: 0, ..default() });
    studio.set_style(SurfaceStyle::ImageBased);
    for _ in 0..3 {
        studio.shoot();
    }
    let image_based = studio.shoot();
    studio.set_style(SurfaceStyle::Classic(sharp(MATTE)));
    let under_dome = studio.shoot();
    let differences = [&engine, &image_based, &under_dome].map(|other| other.difference(&classic));
    println!("engine, image-based, classic under a dome: {differences:?}");
    // The ball shadows itself a little in the dome's maps, as it does in both.
    assert!(differences[0] <= ROUNDING && under_dome.difference(&image_based) <= ROUNDING);
    assert!(differences[1] <= 4);
}
