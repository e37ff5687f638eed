//! Light straight from the ball in the camera frame.

use super::twin::sharp;
use crate::studio::{BACKGROUND, Picture, SIZE, Studio};
use bevy::{camera::RenderTarget, prelude::*};
use bevy_mirrorball::{camera::FramePixels, prelude::*};

/// Texels of 32 and 16 across, interpolated, and rounding to 8 bits of frame and picture.
const TOLERANCE: f32 = 0.015;
const FRAME_SIZE: UVec2 = UVec2::splat(384);
/// Focal length in pixels of the frame.
const FOCAL: f32 = 320.0;
const BALL: Vec3 = Vec3::new(0.22, 0.15, -1.0);
const RADIUS: f32 = 0.12;
/// The virtual ball, beside the real one.
const TWIN: Vec3 = Vec3::new(-0.2, -0.15, -1.0);
const TWIN_RADIUS: f32 = 0.2;

/// Direction of the view through a place of a picture, −1…1 to the right and up.
fn ray(place: Vec2) -> Vec3 {
    (place * (0.5 * FRAME_SIZE.x as f32 / FOCAL)).extend(-1.0).normalize()
}

/// Normal of a ball where a ray meets it, on the axes of the view: to the right, up, and towards the camera at its
/// center or, as in the shader, at the point that is seen.
fn normal_on(center: Vec3, radius: f32, ray: Vec3, is_real: bool) -> Option<Vec3> {
    let along = ray.dot(center);
    let depth = along * along - center.length_squared() + radius * radius;
    let normal = (ray * (along - (depth > 0.0).then(|| depth.sqrt())?) - center) / radius;
    let axis = if is_real { -center.normalize() } else { -ray };
    let right = Vec3::Y.cross(axis).normalize();
    Some(Vec3::new(normal.dot(right), normal.dot(axis.cross(right)), normal.dot(axis)))
}

/// What a far ball shows of a room at a normal.
fn shown(normal: Vec3) -> Vec3 {
    radiance(2.0 * normal.z * normal - Vec3::Z)
}

/// A room in view space, of one slope per channel.
fn radiance(dir: Vec3) -> Vec3 {
    0.4 + Vec3::new(0.3 * dir.x, 0.3 * dir.y, 0.2 * dir.z)
}

/// The same summed up over the cosine: two thirds of a slope.
fn irradiance(normal: Vec3) -> Vec3 {
    0.4 + (radiance(normal) - 0.4) * (2.0 / 3.0)
}

/// A photographed ball that shows the room, and a virtual one beside it.
fn studio(style: ClassicStyle) -> Option<Studio> {
    let mut studio = Studio::new(SurfaceStyle::Engine)?;
    let world = studio.app.world_mut();
    world.despawn(studio.camera);
    world.despawn(studio.ball);
    let mut rgba = vec![255; 4 * FRAME_SIZE.element_product() as usize];
    for (i, pixel) in rgba.chunks_exact_mut(4).enumerate() {
        let at = UVec2::new(i as u32 % FRAME_SIZE.x, i as u32 / FRAME_SIZE.x);
        let place = (at.as_vec2() + 0.5) / (0.5 * FRAME_SIZE.as_vec2()) - 1.0;
        let normal = normal_on(BALL, RADIUS, ray(Vec2::new(place.x, -place.y)), true);
        let light = normal.map_or(BACKGROUND.to_linear(), |normal| {
            let light = shown(normal);
            LinearRgba::rgb(light.x, light.y, light.z)
        });
        let color = Srgba::from(light).to_u8_array();
        pixel.copy_from_slice(&color);
    }
    let intrinsics = Intrinsics::new(Vec2::splat(FOCAL), 0.5 * FRAME_SIZE.as_vec2(), FRAME_SIZE);
    let frame = FramePixels::new(FRAME_SIZE, rgba).expect("as many bytes");
    let target = RenderTarget::Image(studio.picture.clone().into());
    world.spawn((ArCamera::new(intrinsics), CameraFeed::pixels(frame), Transform::default(), target, Msaa::Off));
    world
        .spawn((LightProbeSphere { radius: RADIUS, reflectance: 1.0, ..default() }, Transform::from_translation(BALL)));
    let twin = Sphere::new(TWIN_RADIUS).mesh().ico(40).expect("few enough");
    studio.ball = studio.add(twin, Color::WHITE, (SurfaceStyle::Classic(style), Transform::from_translation(TWIN)));
    for _ in 0..3 {
        studio.shoot();
    }
    Some(studio)
}

/// Largest difference from a function of the normal, well inside of the virtual ball.
fn worst(picture: &Picture, expected: impl Fn(Vec3) -> Vec3) -> f32 {
    let mut worst: f32 = 0.0;
    let mut count = 0;
    for (x, y) in (0..SIZE.y).flat_map(|y| (0..SIZE.x).map(move |x| (x, y))) {
        let place = (Vec2::new(x as f32, y as f32) + 0.5) / (0.5 * SIZE.as_vec2()) - 1.0;
        let normal = normal_on(TWIN, TWIN_RADIUS, ray(Vec2::new(place.x, -place.y)), false);
        let Some(normal) = normal.filter(|normal| normal.z > 0.55) else { continue };
        worst = worst.max((picture.linear(UVec2::new(x, y)) - expected(normal)).abs().max_element());
        count += 1;
    }
    assert!(count > 300, "the virtual ball is in the picture: {count} pixels");
    worst
}

fn of_ball(diffuse: f32, mirror: f32) -> ClassicStyle {
    sharp(ClassicModel::SphereMap(SphereMapModel { diffuse, mirror }))
}

#[test]
fn a_mirror_shows_what_the_ball_shows_and_paper_what_is_around_it() {
    let Some(mut studio) = studio(of_ball(0.0, 1.0)) else { return };
    let mirrored = worst(&studio.shoot(), shown);
    studio.set_style(SurfaceStyle::Classic(of_ball(1.0, 0.0)));
    let diffuse = worst(&studio.shoot(), irradiance);
    studio.set_style(SurfaceStyle::Classic(of_ball(0.5, 0.25)));
    let both = worst(&studio.shoot(), |normal| 0.5 * irradiance(normal) + 0.25 * shown(normal));
    println!("mirror off by {mirrored}, diffuse by {diffuse}, both by {both}");
    assert!(mirrored < TOLERANCE && diffuse < TOLERANCE && both < TOLERANCE);
}

#[test]
fn the_weight_of_the_measured_light_counts() {
    let Some(mut studio) = studio(of_ball(1.0, 0.0)) else { return };
    studio.app.world_mut().entity_mut(studio.ball).insert(MeasuredLightWeight(0.5));
    let half = worst(&studio.shoot(), |normal| 0.5 * irradiance(normal));
    println!("off by {half}");
    assert!(half < TOLERANCE);
}
