//! Changes between all styles at run time.

use crate::studio::Studio;
use bevy::prelude::*;
use bevy_mirrorball::{
    materials::{ClassicMaterial, ImageBasedMaterial, ToonMaterial},
    prelude::*,
};

#[test]
fn a_round_through_all_styles_leaves_the_picture_as_it_was() {
    let Some(mut studio) = Studio::new(SurfaceStyle::ImageBased) else { return };
    studio.add_sky(Vec3::new(0.6, 0.64, 0.48), Vec3::splat(0.1), Vec3::new(0.9, 0.7, 0.5));
    studio.app.world_mut().spawn(ShadowDomeLight { directions: 8, resolution: 32, ..default() });
    // The caches of the dome fill.
    for _ in 0..8 {
        studio.shoot();
    }
    let before = studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<ImageBasedMaterial>>(), 1);
    let gloss_map = ClassicStyle { model: ClassicModel::GlossMap, ..default() };
    let styles = [
        SurfaceStyle::Toon(default()),
        SurfaceStyle::Classic(default()),
        SurfaceStyle::Classic(gloss_map),
        SurfaceStyle::Engine,
    ];
    let mut others = Vec::new();
    for style in styles {
        studio.set_style(style);
        others.push(studio.shoot());
        let is_classic = matches!(style, SurfaceStyle::Classic(_));
        assert_eq!(studio.count::<MeshMaterial3d<ClassicMaterial>>(), usize::from(is_classic));
    }
    assert!(others[1].difference(&before) > 5 && others[1].difference(&others[0]) > 5, "classic is a look of its own");
    assert!(others[1].difference(&others[2]) > 5, "and each of its models");
    studio.set_style(SurfaceStyle::ImageBased);
    // Removed materials are gone a frame later.
    studio.shoot();
    assert_eq!(studio.shoot().difference(&before), 0);
    let world = studio.app.world();
    assert_eq!(world.resource::<Assets<ClassicMaterial>>().len(), 0, "a classic material was left");
    assert_eq!(world.resource::<Assets<ToonMaterial>>().len(), 0, "a toon material was left");
}

#[test]
fn equal_styles_share_a_material_and_phantoms_have_none() {
    let style = SurfaceStyle::Classic(default());
    let Some(mut studio) = Studio::new(style) else { return };
    let original = studio.app.world().get::<MeshMaterial3d<StandardMaterial>>(studio.ball).expect("as added").clone();
    let mesh = studio.app.world().get::<Mesh3d>(studio.ball).expect("as added").clone();
    let second = studio.app.world_mut().spawn((mesh.clone(), original.clone(), style)).id();
    let other = SurfaceStyle::Classic(ClassicStyle { fresnel: Some(0.04), ..default() });
    studio.app.world_mut().spawn((mesh, original, other));
    studio.shoot();
    assert_eq!(studio.app.world().resource::<Assets<ClassicMaterial>>().len(), 2);
    studio.app.world_mut().entity_mut(second).insert(PhantomObject::default());
    studio.shoot();
    assert_eq!(studio.count::<MeshMaterial3d<ClassicMaterial>>(), 2);
}
