//! What happens to the finished picture: high dynamic range, tone mapping, bloom, depth of field, antialiasing, fog.

use super::{ALIKE, ON_TOP, SEEN, Scene, UNCHANGED};
use bevy::{camera::Hdr, core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_anti_alias::fxaa::Fxaa;
use bevy_post_process::{
    bloom::{Bloom, BloomCompositeMode, BloomPrefilter},
    dof::{DepthOfField, DepthOfFieldMode},
};

#[test]
fn a_high_dynamic_range_changes_nothing() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    scene.on_camera(Hdr);
    let shown = scene.shoot();
    scene.check("hdr", &shown, &plain);
}

#[test]
fn tone_mapping_without_hdr_is_for_virtual_things_only() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    scene.on_camera(Tonemapping::Reinhard);
    let shown = scene.shoot();
    shown.save("tonemapping");
    let behind = scene.behind(&shown, &plain);
    assert!(behind <= UNCHANGED, "the camera's picture differs by {behind}/255");
    assert!(shown.difference_at(&plain, ON_TOP) > ALIKE, "the box is not tone mapped");

    // With a high dynamic range the engine maps the finished picture. The log says so.
    scene.on_camera(Hdr);
    let mapped = scene.shoot();
    assert!(scene.behind(&mapped, &plain) > 10, "documented otherwise");
}

/// Bloom that only what is brighter than white causes.
fn glow() -> Bloom {
    Bloom {
        prefilter: BloomPrefilter { threshold: 1.0, threshold_softness: 0.0 },
        composite_mode: BloomCompositeMode::Additive,
        intensity: 0.3,
        ..Bloom::OLD_SCHOOL
    }
}

#[test]
fn bloom_above_white_glows_around_lamps_and_leaves_the_photograph() {
    let Some(mut scene) = Scene::new() else { return };
    let thing = scene.add_box();
    let plain = scene.shoot();
    scene.on_camera(glow());
    let shown = scene.shoot();
    scene.check("bloom", &shown, &plain);

    let lamp = scene.add_material(StandardMaterial { emissive: LinearRgba::rgb(8.0, 8.0, 8.0), ..default() });
    scene.desk.app.world_mut().entity_mut(thing).insert(lamp);
    let glowing = scene.shoot();
    glowing.save("bloom_lamp");
    let beside = Vec3::new(0.09, 0.0, 0.0);
    let brightened = -scene.darkened(&glowing, beside);
    println!("a lamp: {brightened}/255 brighter beside it");
    assert!(brightened >= 10, "nothing glows: {brightened}/255");
    assert!(glowing.at(ON_TOP).into_iter().all(|channel| channel >= 250), "the lamp is not white");
}

#[test]
fn natural_bloom_scatters_the_photograph_and_keeps_its_light() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    scene.on_camera(Bloom::NATURAL);
    let shown = scene.shoot();
    shown.save("bloom_natural");
    println!("mean {} without, {} with", plain.mean(), shown.mean());
    assert!((shown.mean() / plain.mean() - 1.0).abs() < 0.04, "{} to {}", plain.mean(), shown.mean());
}

#[test]
fn depth_of_field_has_no_effect() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    let blurred =
        DepthOfField { mode: DepthOfFieldMode::Gaussian, focal_distance: 5.0, aperture_f_stops: 0.01, ..default() };
    scene.on_camera((Hdr, blurred));
    let shown = scene.shoot();
    scene.check("depth_of_field", &shown, &plain);
    assert!(shown.difference(&plain) <= UNCHANGED, "documented otherwise: {}", shown.difference(&plain));
}

#[test]
fn antialiasing_of_the_finished_picture_smooths_the_photograph_too() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    scene.on_camera(Fxaa::default());
    let shown = scene.shoot();
    shown.save("fxaa");
    let behind = scene.behind(&shown, &plain);
    println!("FXAA: {behind}/255 behind, mean {} without, {} with", plain.mean(), shown.mean());
    assert!(behind > UNCHANGED, "documented otherwise: {behind}/255");
    assert!((shown.mean() / plain.mean() - 1.0).abs() < 0.01, "{} to {}", plain.mean(), shown.mean());
}

#[test]
fn fog_lies_before_virtual_things_only() {
    let Some(mut scene) = Scene::with_box() else { return };
    let plain = scene.shoot();
    let fog = DistanceFog { color: Color::WHITE, falloff: FogFalloff::Linear { start: 0.0, end: 1.0 }, ..default() };
    scene.on_camera(fog);
    let shown = scene.shoot();
    shown.save("fog");
    let (behind, fogged) = (scene.behind(&shown, &plain), shown.difference_at(&plain, ON_TOP));
    println!("fog: {behind}/255 behind, box {fogged}/255");
    assert!(behind <= UNCHANGED, "the camera's picture differs by {behind}/255");
    assert!(fogged >= SEEN, "the box is not in the fog: {fogged}/255");
}
