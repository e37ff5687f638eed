//! Metals, rim light and alpha masks of toon surfaces.

use crate::studio::{COLOR_TOLERANCE, EXTENT, RADIUS, SIZE, Studio, ball_mesh, normals};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

const GOLD: Vec3 = Vec3::new(0.8, 0.5, 0.1);

#[test]
fn metals_are_darker_and_have_highlights_in_their_color() {
    const LIGHT: f32 = 0.9;
    let style = SurfaceStyle::Toon(ToonStyle { outline_width: 0.0, ..default() });
    let Some(mut studio) = Studio::new(style) else { return };
    studio.add_lamp(Vec3::new(0.3, 0.3, 0.9), LIGHT);
    let spot = (Vec3::new(0.3, 0.3, 0.9).normalize() + Vec3::Z).normalize();
    let mut shown = |metallic: f32, perceptual_roughness: f32| {
        let base_color = Color::linear_rgb(GOLD.x, GOLD.y, GOLD.z);
        let material = StandardMaterial { base_color, metallic, perceptual_roughness, ..default() };
        let ball = studio.add(ball_mesh(), material, style);
        studio.app.world_mut().despawn(std::mem::replace(&mut studio.ball, ball));
        let picture = studio.shoot();
        let at = |dir: Vec3| {
            let nearest = |(_, a): &(UVec2, Vec3), (_, b): &(UVec2, Vec3)| a.dot(dir).total_cmp(&b.dot(dir));
            picture.linear(normals().max_by(nearest).expect("a ball").0)
        };
        // Off the spot, still in the highest band.
        [at(spot), at(Vec3::new(-0.1, 0.5, 0.8).normalize())]
    };
    let [spot, matte] = shown(0.0, 0.2);
    assert!((spot - LIGHT).abs().max_element() < COLOR_TOLERANCE, "plastics have white highlights: {spot}");
    assert!((matte - LIGHT * GOLD).abs().max_element() < COLOR_TOLERANCE, "{matte}");
    let [spot, matte] = shown(1.0, 0.2);
    assert!((spot - LIGHT * GOLD.lerp(Vec3::ONE, 0.3)).abs().max_element() < COLOR_TOLERANCE, "{spot}");
    assert!((matte - 0.6 * LIGHT * GOLD).abs().max_element() < COLOR_TOLERANCE, "{matte}");
    let [_, matte] = shown(1.0, 0.9);
    assert!((matte - LIGHT * GOLD).abs().max_element() < COLOR_TOLERANCE, "rough metals are matte: {matte}");
}

#[test]
fn the_rim_light_is_a_stripe_of_the_light_from_behind() {
    let (dark, bright) = (Vec3::new(0.1, 0.1, 0.2), Vec3::new(0.4, 0.2, 0.1));
    let rim = |rim| SurfaceStyle::Toon(ToonStyle { rim, highlight: false, outline_width: 0.0, ..default() });
    let Some(mut studio) = Studio::new(rim(0.0)) else { return };
    studio.add_sky(Vec3::NEG_Z, dark, bright);
    let without = studio.shoot();
    for strength in [0.5, 1.0, 9.0] {
        studio.set_style(rim(strength));
        let with = studio.shoot();
        let mut stripe = 0;
        for i in 0..SIZE.element_product() {
            let pixel = UVec2::new(i % SIZE.x, i / SIZE.x);
            let across = (pixel.as_vec2() + 0.5) / (0.5 * SIZE.as_vec2()) - 1.0;
            let across = Vec2::new(across.x, -across.y) * (EXTENT / RADIUS);
            let depth = 1.0 - across.length_squared();
            let cosine = depth.max(0.0).sqrt();
            if depth < 0.01 || (cosine - 0.3).abs() < 0.08 {
                continue;
            }
            let behind = (across.extend(cosine) - Vec3::Z).normalize_or(Vec3::NEG_Z);
            let light = dark.lerp(bright, 0.5 - 0.5 * behind.z);
            let expected = if cosine < 0.3 { light * strength.min(1.0) } else { Vec3::ZERO };
            let added = with.linear(pixel) - without.linear(pixel);
            assert!(
                (added - expected).abs().max_element() < COLOR_TOLERANCE,
                "{added}, expected {expected} at {pixel}"
            );
            stripe += usize::from(cosine < 0.3);
        }
        assert!(stripe > 50, "{stripe}");
    }
}
