//! What of a scene is drawn for a camera: render layers, visibility ranges, decals.

use super::{BOX, IN_SHADOW, ON_TOP, PLACE, Picture, SEEN, Scene, UNCHANGED};
use crate::desk::HEIGHT;
use bevy::{
    camera::visibility::{RenderLayers, VisibilityRange},
    core_pipeline::prepass::DepthPrepass,
    pbr::decal::{ForwardDecal, ForwardDecalMaterial, ForwardDecalMaterialExt},
    prelude::*,
};
use bevy_mirrorball::{prelude::*, shadows::DomeState};

#[test]
fn a_mesh_casts_if_it_shares_a_layer_with_the_dome() {
    let Some(mut scene) = Scene::new() else { return };
    let thing = scene.add_box();
    let plain = scene.shoot();
    // Neither camera nor dome are on its layer.
    scene.desk.app.world_mut().entity_mut(thing).insert(RenderLayers::layer(1));
    let nothing = scene.shoot();
    println!("on another layer: {}/255 from the photograph", nothing.difference(&scene.photo));
    assert!(nothing.difference(&scene.photo) <= UNCHANGED, "an unseen box casts a shadow");
    // The dome is: a shadow of something unseen.
    scene.desk.app.world_mut().entity_mut(scene.desk.dome).insert(RenderLayers::from_layers(&[0, 1]));
    let shadow = scene.shoot();
    shadow.save("layers");
    // Deeper beside where the box would stand: samples under it count too.
    assert!(scene.darkened(&shadow, IN_SHADOW) >= scene.darkened(&plain, IN_SHADOW), "the shadow is missing");
    assert!(shadow.difference_at(&plain, ON_TOP) >= SEEN, "the box is seen");
    // So is the camera: as at first.
    scene.on_camera(RenderLayers::from_layers(&[0, 1]));
    let both = scene.shoot();
    scene.check("layers_of_both", &both, &plain);
}

#[test]
fn what_is_out_of_its_visibility_range_is_neither_seen_nor_casts() {
    let Some(mut scene) = Scene::new() else { return };
    let thing = scene.add_box();
    let plain = scene.shoot();
    let distance = HEIGHT - PLACE.y;
    let far = VisibilityRange::abrupt(0.0, 0.5 * distance);
    scene.desk.app.world_mut().entity_mut(thing).insert(far);
    let nothing = scene.shoot();
    assert!(nothing.difference(&scene.photo) <= UNCHANGED, "off by {}", nothing.difference(&scene.photo));
    let near = VisibilityRange::abrupt(0.0, 2.0 * distance);
    scene.desk.app.world_mut().entity_mut(thing).insert(near);
    let back = scene.shoot();
    scene.check("in_range", &back, &plain);
}

/// Pixels of the top of the box, and how many of them show it.
fn seen_of_top(shown: &Picture, plain: &Picture) -> (usize, usize) {
    let places = (-3..=3).flat_map(|x| (-3..=3).map(move |z| Vec3::new(x as f32, 0.0, z as f32)));
    let places = places.map(|place| ON_TOP + place * (0.3 * BOX / 3.0));
    let seen = places.clone().filter(|place| shown.difference_at(plain, *place) <= 10).count();
    (places.count(), seen)
}

#[test]
fn levels_of_detail_crossfade() {
    for style in [SurfaceStyle::ImageBased, SurfaceStyle::Toon(ToonStyle::default())] {
        let Some(mut scene) = Scene::new() else { return };
        let thing = scene.add_box();
        scene.desk.app.world_mut().entity_mut(thing).insert(style);
        let plain = scene.shoot();
        let distance = HEIGHT - PLACE.y;
        let half =
            VisibilityRange { start_margin: 0.0..0.0, end_margin: 0.8 * distance..1.2 * distance, use_aabb: false };
        scene.desk.app.world_mut().entity_mut(thing).insert(half);
        let faded = scene.shoot();
        faded.save("crossfade");
        let (all, seen) = seen_of_top(&faded, &plain);
        println!("{style:?}: half faded out, {seen} of {all} pixels show the box");
        assert!((all / 5..=4 * all / 5).contains(&seen), "{style:?}: {seen} of {all} pixels");
    }
}

#[test]
fn compressed_models_are_refused_by_name() {
    for extension in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let model = format!(
            r#"{{"asset": {{"version": "2.0"}}, "extensionsUsed": ["{extension}"], "extensionsRequired": ["{extension}"]}}"#
        );
        // The engine's loader reads models with it, and passes its error on.
        let error = gltf::Gltf::from_slice(model.as_bytes()).expect_err("it cannot be read").to_string();
        println!("{error}");
        assert!(error.contains(extension), "{error}");
    }
}

#[test]
fn a_decal_paints_on_the_photograph_and_casts_no_shadow() {
    let Some(mut scene) = Scene::new() else { return };
    scene.on_camera(DepthPrepass);
    let plain = scene.shoot();
    let paint = ForwardDecalMaterial {
        base: StandardMaterial { base_color: Color::srgb(0.9, 0.1, 0.1), unlit: true, ..default() },
        extension: ForwardDecalMaterialExt { depth_fade_factor: 1.0 },
    };
    let world = scene.desk.app.world_mut();
    let paint = world.resource_mut::<Assets<ForwardDecalMaterial<StandardMaterial>>>().add(paint);
    world.spawn((
        ForwardDecal,
        MeshMaterial3d(paint),
        Transform::from_xyz(0.0, 0.02, 0.0).with_scale(Vec3::splat(0.1)),
    ));
    let shown = scene.shoot();
    shown.save("decal");
    let red = shown.at(Vec3::ZERO);
    let beside = shown.difference_at(&plain, Vec3::new(0.08, 0.0, 0.0));
    println!("decal: {red:?}, {beside}/255 beside it");
    assert!(red[0] > 100 && red[1] < 80, "the decal is missing: {red:?}");
    assert!(beside <= UNCHANGED, "a decal casts a shadow: {beside}/255");
    let state = scene.desk.app.world().get::<DomeState>(scene.desk.dome).copied().expect("it is a dome");
    assert_eq!(state.casters, 0);
}
