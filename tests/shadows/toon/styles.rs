//! Changes of surface style at run time.

use crate::studio::{COLOR_TOLERANCE, SIZE, Studio, ball_mesh, toon};
use bevy::prelude::*;
use bevy_mirrorball::{
    materials::{ImageBasedMaterial, OutlineMaterial, ToonMaterial},
    prelude::*,
};

#[test]
fn the_material_is_kept_and_its_changes_are_followed() {
    let Some(mut studio) = Studio::new(toon(2)) else { return };
    let original = studio.app.world().get::<MeshMaterial3d<StandardMaterial>>(studio.ball).expect("not exchanged yet");
    let original = original.id();
    studio.add_lamp(Vec3::Z, 0.5);
    assert!((studio.shoot().linear(SIZE / 2) - 0.5).abs().max_element() < COLOR_TOLERANCE);
    let mut materials = studio.app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    let mut material = materials.get_mut(original).expect("the toon keeps it");
    material.base_color = Color::linear_rgb(1.0, 0.5, 0.0);
    material.emissive = LinearRgba::rgb(0.0, 0.0, 0.25);
    material.emissive_exposure_weight = 0.0;
    material.metallic = 1.0;
    drop(material);
    let color = studio.shoot().linear(SIZE / 2);
    println!("orange that glows blue: {color}");
    assert!((color - Vec3::new(0.5, 0.25, 0.25)).abs().max_element() < COLOR_TOLERANCE);
}

#[test]
fn styles_change_at_run_time_and_leave_nothing_behind() {
    let style = SurfaceStyle::Toon(default());
    let Some(mut studio) = Studio::new(style) else { return };
    studio.add_lamp(Vec3::new(0.8, 0.5, 0.3), 0.8);
    studio.app.world_mut().spawn(ShadowDomeLight { directions: 4, resolution: 32, ..default() });
    let toon = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<OutlineMaterial>>(), 1);
    studio.set_style(SurfaceStyle::ImageBased);
    let smooth = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<ImageBasedMaterial>>(), 1);
    studio.set_style(SurfaceStyle::Engine);
    let engine = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<StandardMaterial>>(), 1);
    assert_eq!(studio.count::<MeshMaterial3d<OutlineMaterial>>(), 0);
    assert!(smooth.difference(&engine) <= 1, "nothing shadows the lamp");
    assert!(toon.difference(&engine) > 20, "a toon looks different");
    assert_eq!(studio.app.world().resource::<Assets<ToonMaterial>>().len(), 0, "a toon material was left");
    assert_eq!(studio.app.world().resource::<Assets<OutlineMaterial>>().len(), 0, "an outline was left");
    studio.set_style(style);
    assert_eq!(studio.shoot().difference(&toon), 0);

    // A toon that turns out to be real, and one that goes.
    studio.app.world_mut().entity_mut(studio.ball).insert(PhantomObject::default());
    studio.shoot();
    assert_eq!(studio.count::<Mesh3d>(), 1, "a phantom has no outline");
    studio.app.world_mut().despawn(studio.ball);
    let ball = studio.add(ball_mesh(), Color::WHITE, style);
    assert_eq!(studio.shoot().difference(&toon), 0);
    studio.app.world_mut().despawn(ball);
    studio.shoot();
    assert_eq!(studio.count::<Mesh3d>(), 0, "the outline goes with its mesh");
}

#[test]
fn a_style_on_a_root_counts_for_meshes_spawned_below_it() {
    let Some(mut studio) = Studio::new(SurfaceStyle::Engine) else { return };
    let root = studio.app.world_mut().spawn((toon(3), Transform::default(), Visibility::default())).id();
    studio.shoot();
    let below = studio.add(ball_mesh(), Color::WHITE, ChildOf(root));
    let other = studio.add(ball_mesh(), Color::WHITE, (ChildOf(below), SurfaceStyle::Engine));
    studio.shoot();
    let is_toon =
        |studio: &Studio, mesh: Entity| studio.app.world().entity(mesh).contains::<MeshMaterial3d<ToonMaterial>>();
    assert_eq!([studio.ball, below, other].map(|mesh| is_toon(&studio, mesh)), [false, true, false]);
    studio.app.world_mut().entity_mut(root).remove::<SurfaceStyle>();
    studio.shoot();
    assert!(!is_toon(&studio, below), "the style was removed");
}
