// Observation of a mirrored ball: which light it shows from the direction of a texel.

#define_import_path bevy_mirrorball::unwrap::ball

#import bevy_mirrorball::probe::ball_view::{
    angle_from, ball_point, neighboring_normal_angle, normal_angle, side_of,
}
#import bevy_mirrorball::probe::solids::{hidden_share, inside_of}
#import bevy_mirrorball::trigonometry::unit_vector
#import bevy_mirrorball::unwrap::bindings::{blockers, surroundings, unwrap}
#import bevy_mirrorball::unwrap::clip_gains::{gain_from, small_light}
#import bevy_mirrorball::unwrap::deconvolution::leaked
#import bevy_mirrorball::unwrap::frame_sampling::{SMOOTH, SOFT_PIXELS, inside_frame, mean_of_frame, sample_frame}
#import bevy_mirrorball::unwrap::observation::{MIN_CONFIDENCE, Observation, world_direction}

const PI: f32 = 3.14159265358979;
/// Sharpness of lookups on a ball. Deconvolution makes up for the leak between its pixels, so they are less sharp than
/// those of lenses and do not show as squares.
const SHARP_BALL: f32 = 2.0;
/// Number of rim points whose mean fills a hidden direction.
const RING: u32 = 12u;
/// Angles inside the rim, in radians, between which the direct view of the surroundings replaces the ball's coarse
/// reflection of them.
const RIM: vec2f = vec2f(0.6, 0.15);

/// Pixel position of a point in camera space.
fn project(pos_camera: vec3f) -> vec2f {
    return unwrap.center + unwrap.focal * vec2f(pos_camera.x, -pos_camera.y) / max(-pos_camera.z, 1e-6);
}

/// Visibility of a point from the camera, 0…1, past the frame's border and the blockers.
fn visibility_of(point: vec3f) -> f32 {
    let margin = SOFT_PIXELS * max(-point.z, 0.0) / unwrap.focal.x;
    var view = inside_frame(project(point));
    for (var i = 0u; i < arrayLength(&blockers); i++) {
        view *= 1.0 - hidden_share(blockers[i], margin, point);
    }
    return view;
}

/// Radiance of the surroundings in a direction from the ball, where the frame itself shows them; a: visibility, 0…1.
fn surroundings_from(dir: vec3f) -> vec4f {
    let ball = unwrap.ball;
    var nearest = 1e6;
    for (var i = 0u; i < arrayLength(&surroundings); i++) {
        let span = inside_of(surroundings[i], vec3f(1.0), ball.center_camera, dir);
        if span.x > 0.0 && span.x <= span.y {
            nearest = min(nearest, span.x);
        }
    }
    // Where no solid is known, the point is far away.
    let point = ball.center_camera + dir * min(nearest, 1e3);
    if point.z > -1e-3 {
        return vec4f(0.0);
    }
    let pixel = project(point);
    var view = inside_frame(pixel) * unwrap.has_solids;
    // Distance from the ball's outline, as the sine of the angle between point and outline, in pixels.
    let to_ball = normalize(ball.center_camera);
    let beside = length(cross(normalize(point), to_ball)) - ball.radius / length(ball.center_camera);
    view *= clamp(beside * unwrap.focal.x / SOFT_PIXELS - 0.5, 0.0, 1.0);
    for (var i = 0u; i < arrayLength(&surroundings); i++) {
        let span = inside_of(surroundings[i], vec3f(1.0), vec3f(0.0), point);
        // The point is hidden by another solid, or on the far side of its own.
        view *= select(1.0, 0.0, span.x <= span.y && span.y > 0.0 && max(span.x, 0.0) < 0.98);
    }
    return vec4f(sample_frame(pixel, vec3f(1.0), SMOOTH), view);
}

/// Observation of the direction at a position on a cube face; `step` is the distance between texels.
fn observe(face: u32, p: vec2f, step: f32) -> Observation {
    let ball = unwrap.ball;
    let axis = -normalize(ball.center_camera);
    let dir_world = world_direction(face, p);
    let dir = unwrap.camera_from_world * dir_world;
    let side = side_of(axis, dir);
    let angle = angle_from(axis, dir);
    let theta = normal_angle(ball, min(angle, ball.edge_angle));
    let point = ball_point(ball, axis, side, theta);
    let pixel = project(point);
    let to_right = unwrap.camera_from_world * world_direction(face, p + vec2f(step, 0.0));
    let to_down = unwrap.camera_from_world * world_direction(face, p + vec2f(0.0, step));
    let theta_right = neighboring_normal_angle(ball, min(angle_from(axis, to_right), ball.edge_angle), theta);
    let theta_down = neighboring_normal_angle(ball, min(angle_from(axis, to_down), ball.edge_angle), theta);
    let texel = mat2x2f(
        project(ball_point(ball, axis, side_of(axis, to_right), theta_right)) - pixel,
        project(ball_point(ball, axis, side_of(axis, to_down), theta_down)) - pixel,
    );
    let gain = gain_from(dir_world, dir);
    var seen: Observation;
    let at_rim = smoothstep(ball.edge_angle - RIM.x, ball.edge_angle - RIM.y, angle);
    let sharpness = mix(SHARP_BALL, SMOOTH, at_rim);
    let mean = mean_of_frame(pixel, texel, gain, sharpness);
    // The correction never exceeds the mean, so that sensor noise in the dark stays small.
    seen.radiance = (mean + clamp(leaked(pixel, texel, sharpness), -mean, mean)) / ball.reflectance;
    seen.resolution = clamp(sqrt(abs(determinant(texel))), MIN_CONFIDENCE, 1.0);
    seen.visibility = visibility_of(point) * clamp((ball.edge_angle - angle) / RIM.y, 0.0, 1.0);
    // At the edge of the visible part the guess continues it. Where the ball is covered or outside of the frame, the
    // guess is worth little.
    seen.guess_quality = visibility_of(point);
    if angle > ball.edge_angle {
        // A hidden direction gets the mean of an arc of the rim. The arc grows from the rim's nearest point, at the
        // edge, to the whole ring, in the middle of the gap.
        let other = cross(axis, side);
        let rim_theta = normal_angle(ball, ball.edge_angle);
        let inward = clamp((angle - ball.edge_angle) / (PI - ball.edge_angle), 0.0, 1.0);
        var ring = vec4f(0.0);
        for (var i = 0u; i < RING; i++) {
            let azimuth = unit_vector(PI * inward * ((2.0 * f32(i) + 1.0) / f32(RING) - 1.0));
            let rim = ball_point(ball, axis, side * azimuth.x + other * azimuth.y, rim_theta);
            let weight = visibility_of(rim) + 1e-3;
            ring += vec4f(sample_frame(project(rim), gain, SMOOTH) / ball.reflectance, 1.0) * weight;
        }
        seen.radiance = ring.rgb / ring.w;
        seen.guess_quality = min(ring.w / f32(RING), 1.0);
    }
    if max(at_rim, 1.0 - seen.guess_quality) > 0.0 {
        let direct = surroundings_from(dir);
        let weight = direct.a * max(at_rim, 1.0 - seen.guess_quality);
        seen.radiance = mix(seen.radiance, direct.rgb, weight);
        seen.guess_quality = max(seen.guess_quality, weight);
    }
    seen.radiance += small_light(dir_world);
    return seen;
}
