//! Images of the maps that light a scene.

use crate::{gpu, sky_cube::sky_cube};
use bevy::prelude::*;
use bevy_mirrorball::{
    debug::{MapView, MapViewPlugin, ShownMap},
    environment_map::{EnvironmentCube, equirect_direction},
    headless,
    prefilter::{FilteredEnvironment, LiveEnvironment, PrefilterPlugin},
};

/// Half floats, texels 2.8° wide and the filter's own blur.
const TOLERANCE: f32 = 0.02;

fn sky(dir: Vec3) -> Vec3 {
    0.4 + 0.3 * dir
}

fn picture(app: &mut App, map: ShownMap, view: Entity) -> Vec<Vec3> {
    app.world_mut().get_mut::<MapView>(view).expect("it is there").map = map;
    for _ in 0..4 {
        app.update();
    }
    let image = app.world().get::<MapView>(view).expect("it is there").image.clone();
    let bytes = headless::read_texture(app, &image).expect("the picture comes back");
    let value = |bytes: &[u8]| half::f16::from_le_bytes([bytes[0], bytes[1]]).to_f32();
    bytes.chunks_exact(8).map(|texel| Vec3::new(value(texel), value(&texel[2..]), value(&texel[4..]))).collect()
}

#[test]
fn each_map_is_shown_with_its_directions_in_place() {
    let Some(mut app) = gpu::app(|app| {
        app.add_plugins((PrefilterPlugin, MapViewPlugin));
    }) else {
        return;
    };
    let source = app.world_mut().resource_mut::<Assets<Image>>().add(sky_cube(64, sky));
    let (_, target) = headless::add_target(&mut app, UVec2::splat(16));
    let camera = app.world_mut().spawn((Camera3d::default(), LiveEnvironment::new(source.clone()), target)).id();
    app.world_mut().spawn(EnvironmentCube(source));
    let view = MapView::new(ShownMap::Measured, &mut app.world_mut().resource_mut::<Assets<Image>>());
    let view = app.world_mut().spawn(view).id();
    for _ in 0..3 {
        app.update();
    }
    let roughest = app.world().get::<FilteredEnvironment>(camera).expect("is lit").roughest_level();
    // A radiance that is linear in the direction keeps its mean, and 2/3 of its slope as irradiance ÷ π.
    let cases = [
        (ShownMap::Measured, Some(1.0)),
        (ShownMap::Diffuse, Some(2.0 / 3.0)),
        (ShownMap::Specular(0), Some(1.0)),
        (ShownMap::Specular(roughest), None),
        (ShownMap::Confidence, None),
    ];
    for (map, slope) in cases {
        let shown = picture(&mut app, map, view);
        assert_eq!(shown.len() as u32, MapView::SIZE.element_product());
        let mut worst = 0.0_f32;
        for (i, texel) in shown.iter().enumerate() {
            let place = UVec2::new(i as u32 % MapView::SIZE.x, i as u32 / MapView::SIZE.x).as_vec2() + 0.5;
            let dir = equirect_direction(place / MapView::SIZE.as_vec2());
            let expected = match slope {
                Some(slope) => 0.4 + 0.3 * slope * dir,
                None if map == ShownMap::Confidence => Vec3::ONE,
                None => continue,
            };
            worst = worst.max((*texel - expected).abs().max_element());
        }
        println!("{map:?} is off by up to {worst:.4}");
        assert!(worst < TOLERANCE, "{map:?}");
    }
    let rough = picture(&mut app, ShownMap::Specular(roughest), view);
    let contrast = |shown: &[Vec3]| shown.iter().map(|texel| texel.y).fold(0.0, f32::max);
    let sharp = contrast(&picture(&mut app, ShownMap::Specular(0), view));
    assert!(contrast(&rough) < sharp - 0.05 && contrast(&rough) > 0.45, "the roughest level is blurred");
}
