//! Dome shadows on classic surfaces.

use super::twin::paper_radiance;
use crate::studio::{COLOR_TOLERANCE, Picture, SIZE, Studio};
use bevy::{camera::RenderTarget, prelude::*};
use bevy_mirrorball::{camera::FramePixels, prelude::*, probe::UniformSky};

const SKY: f32 = 0.3;
/// Height of the wall.
const WALL: f32 = 0.3;
/// Place of its face.
const FACE: f32 = -0.3;
const FOCAL: f32 = 80.0;
const EXPONENT: f32 = 4.0;
/// The filter of the dome's few directions on a picture of 96 pixels, beside rounding.
const SHADOW_TOLERANCE: f32 = 1.5 * COLOR_TOLERANCE;

/// A desk beside a long wall under an even sky, from above, with one virtual surface on it.
struct Desk {
    studio: Studio,
    desk: Entity,
}

impl Desk {
    fn new(material: StandardMaterial, style: SurfaceStyle, occludes_reflections: bool) -> Option<Self> {
        let mut studio = Studio::new(SurfaceStyle::Engine)?;
        let world = studio.app.world_mut();
        world.despawn(studio.ball);
        world.despawn(studio.camera);
        let intrinsics = Intrinsics::new(Vec2::splat(FOCAL), 0.5 * SIZE.as_vec2(), SIZE);
        let gray = FramePixels::new(SIZE, vec![128; 4 * SIZE.element_product() as usize]).expect("as many bytes");
        let above = Transform::from_xyz(0.0, 1.0, 0.0).looking_at(Vec3::ZERO, Vec3::NEG_Z);
        let target = RenderTarget::Image(studio.picture.clone().into());
        world.spawn((ArCamera::new(intrinsics), CameraFeed::pixels(gray), above, target, Msaa::Off));
        let sky = UniformSky { radiance: Some(Vec3::splat(SKY)) };
        world.spawn((LightProbeSphere { radius: 0.1, ..default() }, sky, Transform::from_xyz(0.3, 0.05, 0.3)));
        world.spawn(ShadowDomeLight { surfels: 0, key_lights: 0, occludes_reflections, ..default() });
        let desk = studio.add(Plane3d::default().mesh().size(2.0, 2.0).build(), material, style);
        let wall = Cuboid::new(0.02, WALL, 4.0).mesh().build();
        let wall = wall.translated_by(Vec3::new(FACE - 0.01, 0.5 * WALL, 0.0));
        studio.add(wall, Color::WHITE, SurfaceStyle::Engine);
        Some(Self { studio, desk })
    }

    fn shoot(&mut self, style: SurfaceStyle) -> Picture {
        self.studio.app.world_mut().entity_mut(self.desk).insert(style);
        // The caches of the visibility pass fill.
        for _ in 0..3 {
            self.studio.shoot();
        }
        self.studio.shoot()
    }
}

/// A pixel, the place on the desk that it shows, and the fraction of the sky that the wall leaves there.
fn places() -> impl Iterator<Item = (UVec2, Vec3, f32)> {
    [0.03, 0.06, 0.1, 0.15, 0.25, 0.4, 0.7].into_iter().map(|away| {
        let column = (0.5 * SIZE.x as f32 + FOCAL * (away + FACE)) as u32;
        let place = Vec3::X * ((column as f32 + 0.5 - 0.5 * SIZE.x as f32) / FOCAL);
        // A long wall hides half of (1 − sin of the angle between its upper edge and the zenith) of a uniform sky.
        let left = 0.5 * (1.0 + f32::sin(f32::atan((place.x - FACE) / WALL)));
        (UVec2::new(column, SIZE.y / 2), place, left)
    })
}

fn matte() -> StandardMaterial {
    StandardMaterial { reflectance: 0.0, ..Color::WHITE.into() }
}

const DIFFUSE: CombinedModel =
    CombinedModel { ambient: 0.0, diffuse: 1.0, specular: 0.0, reflection: 0.0, exponent: EXPONENT };

fn combined(model: CombinedModel) -> SurfaceStyle {
    SurfaceStyle::Classic(ClassicStyle { model: ClassicModel::Combined(model), ..default() })
}

#[test]
fn diffuse_light_is_shadowed_as_on_image_based_surfaces() {
    let Some(mut desk) = Desk::new(matte(), SurfaceStyle::ImageBased, false) else { return };
    let image_based = desk.shoot(SurfaceStyle::ImageBased);
    let classic = desk.shoot(combined(DIFFUSE));
    let darkest = places().map(|(pixel, ..)| classic.linear(pixel).x).fold(1.0, f32::min);
    println!("a difference of {}, down to {darkest:.3}", classic.difference(&image_based));
    assert!(darkest < 0.7 * SKY, "there is a shadow");
    assert!(classic.difference(&image_based) <= 1);
}

#[test]
fn shadows_take_the_highlight_first_and_reflections_as_the_dome_says() {
    let Some(mut desk) = Desk::new(matte(), SurfaceStyle::ImageBased, true) else { return };
    let light = RealLight {
        id: 1,
        direction: Vec3::new(-0.3, 1.0, 0.0).normalize(),
        position: None,
        color: LinearRgba::WHITE,
        irradiance: 0.7,
        angular_radius: 0.05,
        fraction: 0.5,
    };
    desk.studio.app.world_mut().spawn(light);
    let shiny = desk.shoot(combined(CombinedModel { diffuse: 0.0, specular: 1.0, ..DIFFUSE }));
    let mirror = desk.shoot(combined(CombinedModel { diffuse: 0.0, reflection: 1.0, ..DIFFUSE }));
    let roughness = matte().perceptual_roughness;
    for (pixel, place, left) in places() {
        let view = (Vec3::Y - place).normalize();
        let between = (view + light.direction).normalize();
        let open = paper_radiance(&light).x * between.y.powf(EXPONENT);
        let fraction = (paper_radiance(&light).x * light.direction.y / SKY).clamp(0.3, 1.0);
        let expected = open * (1.0 - (1.0 - left) / fraction).clamp(0.0, 1.0);
        let found = shiny.linear(pixel).x;
        println!("{left:.2} of the sky: highlight {found:.3}, expected {expected:.3}, without shadow {open:.3}");
        assert!((found - expected).abs() < SHADOW_TOLERANCE);
        // Lagarde and de Rousiers 2014.
        let power = f32::exp2(-16.0 * roughness * roughness - 1.0);
        let expected = SKY * ((view.y + left).powf(power) - 1.0 + left).clamp(0.0, 1.0);
        let found = mirror.linear(pixel).x;
        println!("    reflection {found:.3}, expected {expected:.3}, without shadow {SKY:.3}");
        assert!((found - expected).abs() < SHADOW_TOLERANCE);
    }
}
