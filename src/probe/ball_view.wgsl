// Which point of a mirrored ball shows which direction. Twin of ball_view.rs, where the derivation is.

#define_import_path bevy_mirrorball::probe::ball_view

#import bevy_mirrorball::trigonometry::{angle_of, unit_vector}

/// Mirror of `BallUniform` in unwrap/unwrap_uniform.rs. Camera space, metres, Bevy axes.
struct Ball {
    center_camera: vec3f,
    radius: f32,
    /// Directions at a larger angle from the axis to the camera are not measured, in radians.
    edge_angle: f32,
    /// Share of the light the ball mirrors.
    reflectance: f32,
}

const NEWTON_STEPS: u32 = 5u;
/// From the answer for a direction a degree beside.
const NEIGHBOR_STEPS: u32 = 2u;
/// Shortest component of a direction across the axis that still has an azimuth.
const AZIMUTH_EPSILON: f32 = 1e-6;

/// One step closer to the angle of the surface point that mirrors the direction at an angle from the axis.
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

/// The same, from the angle of a direction close by.
fn neighboring_normal_angle(ball: Ball, mirrored_angle: f32, close_by: f32) -> f32 {
    let distance = length(ball.center_camera) / ball.radius;
    var theta = close_by;
    for (var i = 0u; i < NEIGHBOR_STEPS; i++) {
        theta = newton_step(distance, mirrored_angle, theta);
    }
    return theta;
}

/// Unit vector across the axis towards a direction; any such vector where the direction is on the axis.
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

/// Point of the ball in camera space at an angle from the axis on the given side.
fn ball_point(ball: Ball, axis: vec3f, side: vec3f, theta: f32) -> vec3f {
    let normal = unit_vector(theta);
    return ball.center_camera + ball.radius * (axis * normal.x + side * normal.y);
}
