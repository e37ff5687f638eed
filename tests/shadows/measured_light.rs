//! How much of the measured light surfaces receive.

use crate::studio::{COLOR_TOLERANCE, Picture, Studio, normals, toon};
use bevy::prelude::*;
use bevy_mirrorball::{materials::ImageBasedMaterial, prelude::*};

const DIR_SKY: Vec3 = Vec3::new(0.6, 0.64, 0.48);
const LAMP_RADIANCE: f32 = 0.5;

/// A white ball under the sky.
fn under_sky(style: SurfaceStyle) -> Option<Studio> {
    let mut studio = Studio::new(style)?;
    studio.add_sky(DIR_SKY, Vec3::splat(0.2), Vec3::new(0.9, 0.7, 0.5));
    Some(studio)
}

fn shoot_weighted(studio: &mut Studio, weight: f32) -> Picture {
    studio.app.world_mut().entity_mut(studio.ball).insert(MeasuredLightWeight(weight));
    studio.shoot()
}

/// Largest difference on the ball between a picture and a multiple of another.
fn difference_from_multiple(picture: &Picture, factor: f32, other: &Picture) -> f32 {
    let differences = normals().map(|(pixel, _)| picture.linear(pixel) - factor * other.linear(pixel));
    differences.map(|difference| difference.abs().max_element()).fold(0.0, f32::max)
}

#[test]
fn surfaces_receive_the_fraction_of_the_light_that_the_weight_says() {
    for (style, has_dome) in [
        (SurfaceStyle::ImageBased, false),
        (SurfaceStyle::ImageBased, true),
        (SurfaceStyle::Classic(default()), true),
        (toon(3), true),
    ] {
        let Some(mut studio) = under_sky(style) else { return };
        if has_dome {
            studio.app.world_mut().spawn(ShadowDomeLight { directions: 8, resolution: 32, surfels: 0, ..default() });
            // The caches of the dome fill.
            for _ in 0..8 {
                studio.shoot();
            }
        }
        let whole = studio.shoot();
        for (weight, expected) in [(0.5, 0.5), (0.25, 0.25), (-1.0, 0.0), (f32::NAN, 0.0), (7.0, 1.0)] {
            let weighted = shoot_weighted(&mut studio, weight);
            let difference = difference_from_multiple(&weighted, expected, &whole);
            println!("{style:?}, dome {has_dome}, {weight}: off by {difference}");
            assert!(difference < COLOR_TOLERANCE);
        }
        studio.app.world_mut().entity_mut(studio.ball).remove::<MeasuredLightWeight>();
        assert_eq!(studio.shoot().difference(&whole), 0, "and all of it without a weight");
    }
}

#[test]
fn without_measured_light_the_authors_is_left() {
    for style in [SurfaceStyle::ImageBased, toon(3)] {
        let light = |studio: &mut Studio| {
            studio.add_lamp(Vec3::new(-0.3, 0.5, 0.8), LAMP_RADIANCE);
            let ambient = AmbientLight { brightness: 500.0, ..default() };
            studio.app.world_mut().entity_mut(studio.camera).insert(ambient);
        };
        let Some(mut dark) = Studio::new(style) else { return };
        light(&mut dark);
        let expected = dark.shoot();
        let Some(mut studio) = under_sky(style) else { return };
        light(&mut studio);
        let both = studio.shoot();
        let left = shoot_weighted(&mut studio, 0.0);
        let difference = difference_from_multiple(&left, 1.0, &expected);
        println!("{style:?}: off by {difference}");
        assert!(difference < COLOR_TOLERANCE && left.difference(&both) > 20);
    }
}

#[test]
fn the_nearest_weight_applies_and_materials_of_old_ones_are_gone() {
    let Some(mut studio) = under_sky(SurfaceStyle::ImageBased) else { return };
    let whole = studio.shoot();
    let parent = studio.app.world_mut().spawn((Transform::default(), Visibility::default(), MeasuredLightWeight(0.5)));
    let parent = parent.id();
    studio.app.world_mut().entity_mut(studio.ball).insert(ChildOf(parent));
    let inherited = studio.shoot();
    assert!(difference_from_multiple(&inherited, 0.5, &whole) < COLOR_TOLERANCE);
    assert!(shoot_weighted(&mut studio, 1.0).difference(&whole) <= 1, "its own comes first");
    for i in 0..20 {
        shoot_weighted(&mut studio, 0.05 * i as f32);
    }
    studio.shoot();
    assert_eq!(studio.app.world().resource::<Assets<ImageBasedMaterial>>().len(), 1);
}
