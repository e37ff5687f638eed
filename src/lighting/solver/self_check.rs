//! Self-check: compares the real ball with a virtual ball that mirrors the displayed light.

use super::{
    desk_frame::DeskFrame,
    detect_lights::DetectedLight,
    radiance_cells::{CELLS_PER_EDGE, cell_index},
    solved_light::SolvedLight,
};
use crate::{
    camera::srgb_to_linear,
    probe::{BallView, EDGE_MARGIN_PIXELS},
};
use bevy::prelude::*;

/// Difference between the real ball and a virtual one in its place; on the entity of the ball.
///
/// The virtual ball mirrors the light that was displayed when the frame arrived, which is that of the previous frame.
/// Lights that have moved or flickered and badly placed balls show up here.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::lighting::SelfCheck;
/// fn warn_if_off(checks: Query<&SelfCheck, Changed<SelfCheck>>) {
///     for check in checks.iter().filter(|check| check.rmse > 0.1) {
///         warn!("the ball does not show the light on display: {}", check.rmse);
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Debug, Clone, PartialEq)]
pub struct SelfCheck {
    /// Sequence number of the frame.
    pub sequence: u64,
    /// Root mean square difference of the pixels, sRGB-encoded, 0…1.
    pub rmse: f32,
    /// Angle between the strongest displayed light and its mirror image in the real ball, radians. `None` without a
    /// light or where the ball shows no clipped pixel near it.
    pub key_light_angle: Option<f32>,
}

/// Number of compared pixels along each side of the ball.
const STEPS: u32 = 48;
/// Largest angle between a light's rim and the directions that its clipped pixels show, radians.
const KEY_LIGHT_MARGIN: f32 = 0.1;

/// Compares a frame with the prediction by a solved light and its strongest light.
pub(in crate::lighting) fn compare_ball(
    desk: &DeskFrame,
    light: &SolvedLight,
    key: Option<&DetectedLight>,
) -> Option<(f32, Option<f32>)> {
    let center = desk.camera_from_world.transform_point3(desk.ball.center);
    let ball = BallView::new(center, desk.ball.radius)?;
    let outline = ball.outline(&desk.intrinsics);
    let keep = 1.0 - 2.0 * EDGE_MARGIN_PIXELS / outline.semi_axes.y.max(2.0 * EDGE_MARGIN_PIXELS);
    let world_from_camera = desk.camera_from_world.inverse();
    let frame = &desk.frame;
    let (mut sum, mut count) = (0.0_f32, 0.0_f32);
    let mut towards_key = Vec3::ZERO;
    for i in 0..STEPS * STEPS {
        let across = (Vec2::new((i % STEPS) as f32, (i / STEPS) as f32) + 0.5) / STEPS as f32 * 2.0 - 1.0;
        if across.length() >= keep {
            continue;
        }
        let turned = Vec2::from_angle(outline.angle).rotate(across * outline.semi_axes);
        let pixel = outline.center + turned;
        if pixel.cmplt(Vec2::ZERO).any() || pixel.cmpge(frame.size.as_vec2()).any() {
            continue;
        }
        let Some(dir_camera) = ball.mirrored_direction(desk.intrinsics.ray(pixel)) else {
            continue;
        };
        let dir_world = world_from_camera.transform_vector3(dir_camera);
        let cell = cell_index(dir_world, CELLS_PER_EDGE);
        let expected = desk.ball.reflectance * light.sky[cell].radiance(light.gains[cell]);
        let real = frame.rgb8(pixel.x as i32, pixel.y as i32);
        for c in 0..3 {
            let difference = encode(expected[c]) - f32::from(real[c]) / 255.0;
            sum += difference * difference;
            count += 1.0;
        }
        if let Some(key) = key
            && real.into_iter().map(srgb_to_linear).fold(0.0, f32::max) > 0.98
            && dir_world.angle_between(key.direction) < key.angular_radius + KEY_LIGHT_MARGIN
        {
            // Pixels nearer to the rim show a larger part of the sky.
            towards_key += dir_world / (1.0 - across.length_squared()).max(0.05).sqrt();
        }
    }
    let angle =
        key.filter(|_| towards_key != Vec3::ZERO).map(|key| towards_key.normalize().angle_between(key.direction));
    (count > 0.0).then(|| ((sum / count).sqrt(), angle))
}

fn encode(linear: f32) -> f32 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.0031308 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}
