//! Ramps as images: inherited, replaced, changed, and not there.

use crate::studio::{Picture, Studio, ball_mesh, normals, toon};
use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
};
use bevy_mirrorball::{materials::ToonMaterial, prelude::*};

const TOLERANCE: f32 = 0.012;
const LIGHT: f32 = 0.8;

/// A ramp of linear grays.
pub(super) fn ramp_image(grays: &[u8]) -> Image {
    let texels = grays.iter().flat_map(|gray| [*gray, *gray, *gray, 255]).collect();
    let extent = Extent3d { width: grays.len() as u32, height: 1, depth_or_array_layers: 1 };
    let (format, usage) = (TextureFormat::Rgba8Unorm, RenderAssetUsages::default());
    Image::new(extent, TextureDimension::D2, texels, format, usage)
}

pub(super) fn ramps_of(studio: &mut Studio, diffuse: Option<&[u8]>, specular: Option<&[u8]>) -> ToonRamps {
    let mut images = studio.app.world_mut().resource_mut::<Assets<Image>>();
    let [diffuse, specular] = [diffuse, specular].map(|grays| grays.map(|grays| images.add(ramp_image(grays))));
    ToonRamps { diffuse, specular }
}

/// A ball under one lamp from the camera, so that positions are N.z.
fn lit_ball() -> Option<Studio> {
    let mut studio = Studio::new(toon(3))?;
    studio.add_lamp(Vec3::Z, LIGHT);
    Some(studio)
}

/// Asserts that the ball shows a ramp over N.z.
fn assert_ramp(picture: &Picture, ramp: &[u8]) {
    for (pixel, normal) in normals() {
        let place = normal.z * ramp.len() as f32;
        // Edges are smoothed over a pixel, at most so far.
        if (place - place.round()).abs() > 0.22 {
            let expected = LIGHT * f32::from(ramp[(place as usize).min(ramp.len() - 1)]) / 255.0;
            let found = picture.linear(pixel).x;
            assert!((found - expected).abs() < TOLERANCE, "{found}, expected {expected} at {normal}");
        }
    }
}

#[test]
fn ramps_stand_in_for_bands_on_all_meshes_below_and_follow_their_images() {
    let Some(mut studio) = lit_ball() else { return };
    let bands = studio.shoot();
    let uneven: &[u8] = &[30, 30, 30, 200, 255];
    let ramps = ramps_of(&mut studio, Some(uneven), None);
    let image = ramps.diffuse.clone().expect("as made");
    let root = studio.app.world_mut().spawn((ramps, Transform::default(), Visibility::default())).id();
    studio.app.world_mut().entity_mut(studio.ball).insert(ChildOf(root));
    assert_ramp(&studio.shoot(), uneven);
    // A nearer one counts.
    let near = ramps_of(&mut studio, Some(&[10, 250]), None);
    studio.app.world_mut().entity_mut(studio.ball).insert(near);
    assert_ramp(&studio.shoot(), &[10, 250]);
    studio.app.world_mut().entity_mut(studio.ball).remove::<ToonRamps>();
    // Their images may change.
    let changed: &[u8] = &[90, 180];
    let mut images = studio.app.world_mut().resource_mut::<Assets<Image>>();
    *images.get_mut(&image).expect("in use") = ramp_image(changed);
    assert_ramp(&studio.shoot(), changed);
    studio.app.world_mut().entity_mut(root).remove::<ToonRamps>();
    assert_eq!(studio.shoot().difference(&bands), 0, "without ramps the bands are back");
    studio.shoot();
    assert_eq!(studio.app.world().resource::<Assets<ToonMaterial>>().len(), 1, "no material is left");
}

#[test]
fn bands_stand_in_for_ramps_that_are_not_there() {
    let Some(mut studio) = lit_ball() else { return };
    let bands = studio.shoot();
    let missing: Handle<Image> = studio.app.world().resource::<AssetServer>().load("no_such_ramp.png");
    studio.app.world_mut().entity_mut(studio.ball).insert(ToonRamps { diffuse: Some(missing), specular: None });
    assert_eq!(studio.shoot().difference(&bands), 0, "a file that is missing");
    let mut compressed = ramp_image(&[0, 255]);
    compressed.texture_descriptor.format = TextureFormat::Bc7RgbaUnorm;
    compressed.texture_descriptor.size = Extent3d { width: 4, height: 4, depth_or_array_layers: 1 };
    compressed.data = Some(vec![0; 16]);
    // Not every device has textures of this format.
    compressed.asset_usage = RenderAssetUsages::MAIN_WORLD;
    let compressed = studio.app.world_mut().resource_mut::<Assets<Image>>().add(compressed);
    studio.app.world_mut().entity_mut(studio.ball).insert(ToonRamps { diffuse: Some(compressed), specular: None });
    assert_eq!(studio.shoot().difference(&bands), 0, "a format that cannot be read");
}

#[test]
fn a_specular_ramp_has_several_steps_of_highlight() {
    let style = SurfaceStyle::Toon(ToonStyle { outline_width: 0.0, ..default() });
    let Some(mut studio) = Studio::new(style) else { return };
    let black = StandardMaterial { base_color: Color::BLACK, perceptual_roughness: 0.2, ..default() };
    let black = studio.add(ball_mesh(), black, style);
    studio.app.world_mut().despawn(std::mem::replace(&mut studio.ball, black));
    studio.add_lamp(Vec3::Z, LIGHT);
    let ramps = ramps_of(&mut studio, None, Some(&[0, 80, 160, 255]));
    studio.app.world_mut().entity_mut(studio.ball).insert(ramps);
    let picture = studio.shoot();
    let mut seen = [0; 4];
    for (pixel, _) in normals() {
        let found = picture.linear(pixel).x / LIGHT;
        for (count, gray) in seen.iter_mut().zip([0.0, 80.0, 160.0, 255.0]) {
            *count += usize::from((found - gray / 255.0).abs() < 0.02);
        }
    }
    println!("pixels of each step: {seen:?}");
    assert!(seen.iter().all(|count| *count >= 20));
}
