//! Options of the reflection: refraction, Fresnel's factor, lamps only, roughness.

use super::twin::{VIEW, assert_shows, mirror, mirrored, radiance, studio};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// Direction behind a surface, for a ratio of the indices of refraction. `None` at total reflection.
fn refracted(normal: Vec3, ratio: f32) -> Option<Vec3> {
    let cos_in = normal.dot(VIEW);
    let sin_out_squared = ratio * ratio * (1.0 - cos_in * cos_in);
    let cos_out = (1.0 - sin_out_squared).max(0.0).sqrt();
    (sin_out_squared <= 1.0).then(|| ratio * -VIEW + (ratio * cos_in - cos_out) * normal)
}

#[test]
fn a_ratio_bends_the_room_behind() {
    let Some(mut studio) = studio(Color::BLACK, mirror()) else { return };
    for ratio in [0.95, 0.67, 1.0, 1.5] {
        studio.set_style(SurfaceStyle::Classic(ClassicStyle { refraction: Some(ratio), ..mirror() }));
        // The step to total reflection is sharp, and the bend has an infinite slope there.
        let is_at_edge = |n: Vec3| (ratio * (1.0 - n.dot(VIEW).powi(2)).sqrt() - 1.0).abs() < 0.1;
        let expected = |n| refracted(n, ratio).map_or(mirrored(n), radiance);
        assert_shows(&studio.shoot(), &format!("ratio {ratio}"), |n| (!is_at_edge(n)).then(|| expected(n)));
    }
    studio.set_style(SurfaceStyle::Classic(ClassicStyle { refraction: Some(f32::NAN), ..mirror() }));
    assert_shows(&studio.shoot(), "no ratio", |n| Some(mirrored(n)));
}

#[test]
fn fresnels_factor_grows_to_grazing_angles() {
    let Some(mut studio) = studio(Color::BLACK, mirror()) else { return };
    for perpendicular in [0.0, 0.04, 0.5, 1.0] {
        studio.set_style(SurfaceStyle::Classic(ClassicStyle { fresnel: Some(perpendicular), ..mirror() }));
        assert_shows(&studio.shoot(), &format!("{perpendicular} along the normal"), |n| {
            Some(mirrored(n) * (perpendicular + (1.0 - perpendicular) * (1.0 - n.dot(VIEW)).powi(5)))
        });
    }
}

#[test]
fn a_threshold_leaves_what_is_brighter() {
    let Some(mut studio) = studio(Color::BLACK, mirror()) else { return };
    let luminance = |color: Vec3| color.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    for threshold in [0.0, 0.3, 0.6, 2.0] {
        studio.set_style(SurfaceStyle::Classic(ClassicStyle { reflection_threshold: threshold, ..mirror() }));
        assert_shows(&studio.shoot(), &format!("above {threshold}"), |n| {
            let all = mirrored(n);
            Some(all * (1.0 - threshold / luminance(all)).max(0.0))
        });
    }
}

#[test]
fn roughness_is_that_of_the_surface_or_of_the_style() {
    const ROUGH: f32 = 0.6;
    let model = mirror().model;
    let Some(mut studio) = studio(Color::BLACK, mirror()) else { return };
    let sharp = studio.shoot();
    studio.set_style(SurfaceStyle::Classic(ClassicStyle { model, roughness: Some(ROUGH), ..default() }));
    let rough = studio.shoot();
    assert!(rough.difference(&sharp) > 10, "the reflection is blurred");
    let surface = StandardMaterial { perceptual_roughness: ROUGH, ..Color::BLACK.into() };
    studio.set_ball(surface, SurfaceStyle::Classic(ClassicStyle { model, ..default() }));
    assert_eq!(studio.shoot().difference(&rough), 0);
}
