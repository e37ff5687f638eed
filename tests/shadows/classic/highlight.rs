//! The highlight of the strongest light: where it is, where it is not, and what it costs when lights move.

use super::twin::{assert_shows, highlight, lobe, real_light, sharp, studio};
use crate::studio::{Studio, normals};
use bevy::{ecs::message::MessageCursor, prelude::*};
use bevy_mirrorball::{materials::ClassicMaterial, prelude::*};

const NOTHING: CombinedModel =
    CombinedModel { ambient: 0.0, diffuse: 0.0, specular: 0.0, reflection: 0.0, exponent: 0.0 };

fn shiny(exponent: f32) -> ClassicStyle {
    sharp(ClassicModel::Combined(CombinedModel { specular: 1.0, exponent, ..NOTHING }))
}

/// Normal at the middle of the highlight.
fn brightest_normal(studio: &mut Studio) -> Vec3 {
    let picture = studio.shoot();
    let brightness = |pixel| picture.linear(pixel).element_sum();
    let weighted = normals().map(|(pixel, normal)| normal * brightness(pixel).powi(4));
    weighted.sum::<Vec3>().normalize_or_zero()
}

#[test]
fn the_highlight_is_halfway_between_view_and_light() {
    let Some(mut studio) = studio(Color::BLACK, shiny(60.0)) else { return };
    assert_eq!(brightest_normal(&mut studio), Vec3::ZERO, "without a light");
    let entity = studio.app.world_mut().spawn(real_light(Vec3::Z)).id();
    for dir in [Vec3::new(0.9, 0.0, 0.4), Vec3::new(-0.3, 0.8, 0.5), Vec3::new(0.2, -0.7, -0.1)] {
        studio.app.world_mut().entity_mut(entity).insert(real_light(dir));
        let expected = (dir.normalize() + Vec3::Z).normalize();
        let found = brightest_normal(&mut studio);
        println!("light at {dir}: highlight at {found}, expected {expected}");
        assert!(found.distance(expected) < 0.04);
    }
    // A stronger one takes over, a weaker one does not.
    let weaker = RealLight { id: 8, irradiance: 1.0, ..real_light(Vec3::X) };
    studio.app.world_mut().spawn(weaker);
    let expected = (Vec3::new(0.2, -0.7, -0.1).normalize() + Vec3::Z).normalize();
    assert!(brightest_normal(&mut studio).distance(expected) < 0.04);
    studio.app.world_mut().despawn(entity);
    let expected = (Vec3::X + Vec3::Z).normalize();
    assert!(brightest_normal(&mut studio).distance(expected) < 0.04);
}

#[test]
fn no_highlight_where_the_light_is_behind_the_surface() {
    const EXPONENT: f32 = 2.0;
    let Some(mut studio) = studio(Color::BLACK, shiny(EXPONENT)) else { return };
    let light = real_light(Vec3::new(0.6, 0.3, -0.6));
    studio.app.world_mut().spawn(light);
    let hidden = |n: Vec3| n.dot(light.direction) < 0.0;
    let cut_off = normals().map(|(_, n)| if hidden(n) { lobe(&light, n, EXPONENT).x } else { 0.0 }).fold(0.0, f32::max);
    assert!(cut_off > 0.2, "the lobe would show there: {cut_off}");
    let is_at_edge = |n: Vec3| n.dot(light.direction).abs() < 0.05;
    let expected = |n| (!is_at_edge(n)).then(|| highlight(&light, n, EXPONENT));
    assert_shows(&studio.shoot(), "from the side", expected);
    let behind = RealLight { direction: Vec3::NEG_Z, ..light };
    let world = studio.app.world_mut();
    let mut lights = world.query::<&mut RealLight>();
    for mut light in lights.iter_mut(world) {
        *light = behind;
    }
    assert_shows(&studio.shoot(), "from behind", |_| Some(Vec3::ZERO));
}

#[test]
fn lights_that_move_remake_no_material() {
    let Some(mut studio) = studio(Color::BLACK, shiny(60.0)) else { return };
    let entity = studio.app.world_mut().spawn(real_light(Vec3::X)).id();
    let first = studio.shoot();
    let mut cursor = MessageCursor::<AssetEvent<ClassicMaterial>>::default();
    cursor.read(studio.app.world().resource()).for_each(drop);
    studio.app.world_mut().entity_mut(entity).insert(real_light(Vec3::Y));
    assert!(studio.shoot().difference(&first) > 50, "the highlight has moved");
    let events: Vec<_> = cursor.read(studio.app.world().resource()).collect();
    assert!(events.is_empty(), "{events:?}");
}
