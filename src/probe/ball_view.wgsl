// Mirrored balls: the point of a ball that shows a direction. Twin of ball_view.rs, which has the derivation.

#define_import_path bevy_mirrorball::probe::ball_view

#import bevy_mirrorball::trigonometry::{angle_of, unit_vector}

/// Mirrored ball in camera space (meters, Bevy axes). Mirror of `BallUniform` in `unwrap/unwrap_uniform.rs`.
struct Ball {
    center_camera: vec3f,
    radius: f32,
    /// Angle from the axis to the camera beyond which directions are not measured, in radians.
    edge_angle: f32,
    /// Fraction of the light that the ball mirrors.
    reflectance: f32,
}

/// Number of Newton steps for a direction on its own.
const NEWTON_STEPS: u32 = 5u;
/// Number of Newton steps from the solution for a direction one degree beside.
const NEIGHBOR_STEPS: u32 = 2u;
/// Lower bound of the component of a direction across the axis for which the azimuth is defined.
const AZIMUTH_EPSILON: f32 = 1e-6;

/// Newton step towards the angle of the surface point that mirrors the direction at an angle from the axis.
fn newton_step(distance: f32, mirrored_angle: f32, theta: f32) -> f32 {
    let normal = unit_vector(theta);
    let view_angle = angle_of(vec2f(distance - normal.x, normal.y));
    let slope = 2.0 + (distance * normal.x - 1.0) / (distance * distance + 1.0 - 2.0 * distance * normal.x);
    return theta - (2.0 * theta + view_angle - mirrored_angle) / slope;
}

/// Angle of the surface point that mirrors the direction at an angle from the axis.
fn normal_angle(ball: Ball, mirrored_angle: f32) -> f32 {
    let distance = length(ball.center_camera) / ball.radius;
    var theta = 0.5 * mirrored_angle * (1.0 - 0.5 / distance);
    for (var i = 0u; i < NEWTON_STEPS; i++) {
        theta = newton_step(distance, mirrored_angle, theta);
    }
    return theta;
}

/// The same as `normal_angle`, starting from the solution for a direction close by.
fn neighboring_normal_angle(ball: Ball, mirrored_angle: f32, close_by: f32) -> f32 {
    let distance = length(ball.center_camera) / ball.radius;
    var theta = close_by;
    for (var i = 0u; i < NEIGHBOR_STEPS; i++) {
        theta = newton_step(distance, mirrored_angle, theta);
    }
    return theta;
}

/// Unit vector perpendicular to the axis, towards a direction; an arbitrary one if the direction is on the axis.
fn side_of(axis: vec3f, dir: vec3f) -> vec3f {
    let across = dir - axis * dot(axis, dir);
    let len = length(across);
    if len < AZIMUTH_EPSILON {
        return normalize(cross(axis, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(axis.x) > 0.7)));
    }
    return across / len;
}

/// Angle of a direction from the axis.
fn angle_from(axis: vec3f, dir: vec3f) -> f32 {
    return angle_of(vec2f(dot(axis, dir), length(dir - axis * dot(axis, dir))));
}

/// Point of the ball in camera space, at an angle from the axis on the given side.
fn ball_point(ball: Ball, axis: vec3f, side: vec3f, theta: f32) -> vec3f {
    let normal = unit_vector(theta);
    return ball.center_camera + ball.radius * (axis * normal.x + side * normal.y);
}
