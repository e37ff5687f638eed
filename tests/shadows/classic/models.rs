//! The three formulas, each coefficient alone and all together.

use super::twin::{BASE, assert_shows, diffuse_map, highlight, mirrored, real_light, sharp, studio};
use bevy::prelude::*;
use bevy_mirrorball::prelude::*;

/// A color in which alpha is a gloss map.
fn with_gloss(alpha: f32) -> StandardMaterial {
    let base_color = Color::linear_rgba(BASE.x, BASE.y, BASE.z, alpha);
    StandardMaterial { base_color, alpha_mode: AlphaMode::Opaque, ..default() }
}

#[test]
fn a_gloss_map_mixes_both_maps_by_alpha() {
    let style = sharp(ClassicModel::GlossMap);
    let Some(mut studio) = studio(with_gloss(1.0), style) else { return };
    for alpha in [0.0, 0.5, 1.0] {
        studio.set_ball(with_gloss(alpha), SurfaceStyle::Classic(style));
        let expected = |n| Some(BASE * mirrored(n).lerp(diffuse_map(n), alpha));
        assert_shows(&studio.shoot(), &format!("alpha {alpha}"), expected);
    }
}

#[test]
fn the_combined_model_is_the_sum_of_its_terms() {
    let none = CombinedModel { ambient: 0.0, diffuse: 0.0, specular: 0.0, reflection: 0.0, exponent: 20.0 };
    let models = [
        none,
        CombinedModel { ambient: 0.3, ..none },
        CombinedModel { diffuse: 0.9, ..none },
        CombinedModel { specular: 0.8, ..none },
        CombinedModel { specular: 0.8, exponent: 3.0, ..none },
        CombinedModel { reflection: 0.6, ..none },
        CombinedModel { ambient: 0.1, diffuse: 0.5, specular: 0.4, reflection: 0.2, ..none },
    ];
    let Some(mut studio) = studio(Color::linear_rgb(BASE.x, BASE.y, BASE.z), default()) else { return };
    let light = real_light(Vec3::new(-0.5, 0.4, 0.7));
    studio.app.world_mut().spawn(light);
    for model in models {
        studio.set_style(SurfaceStyle::Classic(sharp(ClassicModel::Combined(model))));
        let expected = |n| {
            let matte = BASE * (model.ambient + model.diffuse * diffuse_map(n));
            matte + model.specular * highlight(&light, n, model.exponent) + model.reflection * mirrored(n)
        };
        // The edge of the highlight is a step.
        let is_at_edge = |n: Vec3| n.dot(light.direction).abs() < 0.05;
        assert_shows(&studio.shoot(), &format!("{model:?}"), |n| (!is_at_edge(n)).then(|| expected(n)));
    }
}

#[test]
fn the_mixed_model_is_flat_matte_mirroring_or_all_of_it() {
    let Some(mut studio) = studio(Color::linear_rgb(BASE.x, BASE.y, BASE.z), default()) else { return };
    let default = MixedModel::default();
    assert_eq!((default.base, default.diffuse, default.mirror), (0.4, 0.7, 0.5));
    for (diffuse, mirror) in [(0.7, 0.5), (0.0, 0.0), (1.0, 0.0), (0.0, 1.0)] {
        let model = ClassicModel::Mixed(MixedModel { diffuse, mirror, ..default });
        studio.set_style(SurfaceStyle::Classic(sharp(model)));
        assert_shows(&studio.shoot(), &format!("diffuse {diffuse}, mirror {mirror}"), |n| {
            let base = default.base * BASE;
            let matte = base.lerp(diffuse_map(n) * base, diffuse);
            Some(matte.lerp(mirrored(n) + matte, mirror))
        });
    }
}
