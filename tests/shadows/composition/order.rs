//! In which order and with which passes things are drawn: ambient occlusion, deferred, transparent, sorted.

use super::{BOX, ON_TOP, PLACE, SEEN, Scene, UNCHANGED};
use bevy::{
    core_pipeline::{
        oit::OrderIndependentTransparencySettings,
        prepass::{DeferredPrepass, DepthPrepass, NormalPrepass},
    },
    light::NotShadowCaster,
    pbr::{DefaultOpaqueRendererMethod, ScreenSpaceAmbientOcclusion},
    prelude::*,
};
use bevy_mirrorball::prelude::*;

#[test]
fn ambient_occlusion_darkens_creases_of_virtual_things_only() {
    let Some(mut scene) = Scene::with_box() else { return };
    // A wall beside the box: its foot on the top of the box is a crease.
    scene.desk.add_virtual(Cuboid::new(0.03, 0.09, BOX), PLACE + Vec3::new(0.015, 0.075, 0.0));
    let plain = scene.shoot();
    scene.on_camera(ScreenSpaceAmbientOcclusion::default());
    let shown = scene.shoot();
    shown.save("ambient_occlusion");
    let behind = scene.behind(&shown, &plain);
    let crease = Vec3::new(-0.006, BOX, 0.0);
    let darker = i32::from(plain.at(crease)[1]) - i32::from(shown.at(crease)[1]);
    println!("ambient occlusion: behind {behind}, {darker} darker in the crease of 255");
    assert!(behind <= UNCHANGED, "the camera's picture differs by {behind}/255");
    assert!(darker >= 3, "the crease is {darker}/255 darker");
}

#[test]
fn deferred_surfaces_stand_before_the_photograph_beside_forward_ones() {
    let Some(mut scene) = Scene::with_box() else { return };
    // Drawn by the engine, so deferred; the box is always drawn forward.
    let engines = scene.desk.add_virtual(Cuboid::from_length(BOX), PLACE + 0.16 * Vec3::Z);
    scene.desk.app.world_mut().entity_mut(engines).insert(SurfaceStyle::Engine);
    let plain = scene.shoot();
    scene.desk.app.world_mut().insert_resource(DefaultOpaqueRendererMethod::deferred());
    scene.on_camera((DepthPrepass, NormalPrepass, DeferredPrepass));
    // Materials learn of it when they change.
    let mut materials = scene.desk.app.world_mut().resource_mut::<Assets<StandardMaterial>>();
    materials.iter_mut().for_each(|_| ());
    let shown = scene.shoot();
    scene.check("deferred", &shown, &plain);
    let on_engines = ON_TOP + 0.16 * Vec3::Z;
    println!("drawn deferred: off by {}/255", shown.difference_at(&plain, on_engines));
    assert!(shown.difference_at(&scene.photo, on_engines) >= SEEN, "what is drawn deferred is missing");
    assert!(shown.difference_at(&plain, on_engines) <= 8, "what is drawn deferred looks different");
}

/// The scene with two glass sheets above each other, the upper one in a style.
fn glass(style: SurfaceStyle) -> Option<Scene> {
    let mut scene = Scene::new()?;
    for (height, color) in [(0.04, Color::srgba(0.9, 0.1, 0.1, 0.5)), (0.08, Color::srgba(0.1, 0.9, 0.1, 0.5))] {
        let material =
            scene.add_material(StandardMaterial { base_color: color, alpha_mode: AlphaMode::Blend, ..default() });
        let sheet = Plane3d::default().mesh().size(0.1, 0.1).build();
        let sheet = scene.desk.add(sheet, height * Vec3::Y, material);
        scene.desk.app.world_mut().entity_mut(sheet).insert(style);
    }
    Some(scene)
}

fn styles() -> [SurfaceStyle; 2] {
    [SurfaceStyle::ImageBased, SurfaceStyle::Toon(ToonStyle::default())]
}

#[test]
fn the_photograph_shows_through_transparent_things() {
    for style in styles() {
        let Some(mut scene) = glass(style) else { return };
        let shown = scene.shoot();
        shown.save("transparent");
        let middle = 0.04 * Vec3::Y;
        let (through, photo) = (shown.linear_at(middle), scene.photo.linear_at(middle));
        // Two halves of light pass, less the shadow of the sheets on the desk. The upper sheet is green.
        println!("{style:?}: {through} of {photo}");
        assert!(through.y > through.x && through.cmpgt(0.02 * photo).all(), "{style:?}: {through}");
        assert!(shown.difference_at(&scene.photo, middle) >= SEEN, "{style:?}: the sheets are missing");
        let outside = Vec3::new(0.3, 0.0, 0.0);
        assert!(shown.difference_at(&scene.photo, outside) <= UNCHANGED, "{style:?}");
    }
}

#[test]
fn the_photograph_shows_through_glass_that_refracts() {
    let Some(mut scene) = Scene::new() else { return };
    let material = StandardMaterial {
        base_color: Color::srgb(0.2, 0.9, 0.2),
        specular_transmission: 1.0,
        perceptual_roughness: 0.0,
        reflectance: 0.0,
        ..default()
    };
    let material = scene.add_material(material);
    // Without a shadow: it would be all that is to be seen through the glass.
    let sheet = Plane3d::default().mesh().size(0.1, 0.1).build();
    scene.desk.add(sheet, 0.08 * Vec3::Y, (material, NotShadowCaster));
    let shown = scene.shoot();
    shown.save("transmission");
    let middle = 0.08 * Vec3::Y;
    let (through, photo) = (shown.linear_at(middle), scene.photo.linear_at(middle));
    let share = through / photo;
    println!("through green glass: {through} of {photo}");
    assert!(share.y > 0.6 && share.y < 1.1, "the photograph does not show through: {share}");
    assert!(share.x < 0.3 && share.z < 0.3, "the glass has no color: {share}");
    let outside = Vec3::new(0.3, 0.0, 0.0);
    assert!(shown.difference_at(&scene.photo, outside) <= UNCHANGED);
}

#[test]
fn transparency_sorted_by_depth_looks_like_transparency_sorted_by_object() {
    for style in styles() {
        let Some(mut scene) = glass(style) else { return };
        let plain = scene.shoot();
        scene.on_camera(OrderIndependentTransparencySettings::default());
        let sorted = scene.shoot();
        sorted.save("sorted");
        let (difference, behind) = (sorted.difference(&plain), scene.behind(&sorted, &plain));
        println!("{style:?}: off by {difference}/255, {behind}/255 behind");
        assert!(behind <= UNCHANGED, "{style:?}: the camera's picture differs by {behind}/255");
        assert!(difference <= 6, "{style:?}: off by {difference}/255");
    }
}
