// Observation of a frame with many directions: fisheye lens, equirectangular image or sphere map. Twin of
// `probe/lens.rs`.
//
// FISHEYE, EQUIRECT: the kind of frame; neither: a cropped sphere map.

#define_import_path bevy_mirrorball::unwrap::lens

#import bevy_mirrorball::trigonometry::angle_of
#import bevy_mirrorball::unwrap::bindings::{frame, unwrap}
#import bevy_mirrorball::unwrap::frame_sampling::{SHARP, SOFT_PIXELS, inside_frame, mean_of_frame}
#import bevy_mirrorball::unwrap::observation::{MIN_CONFIDENCE, Observation, world_direction}

const PI: f32 = 3.14159265358979;
/// tan 1.57, beyond which the stereographic projection is constant.
const MAX_STEREOGRAPHIC: f32 = 1255.7656;

#ifdef FISHEYE
/// Pixel that shows a direction in camera space.
fn frame_point(dir: vec3f) -> vec2f {
    let across = length(dir.xy);
    // Sine and tangent of half the angle θ from the axis: 2 cos²(θ/2) = 1 + cos θ.
    let twice_squared = max(1.0 - dir.z, 1e-6);
    let angle = angle_of(vec2f(-dir.z, across));
    let equisolid = min(across * inverseSqrt(0.5 * twice_squared), 2.0);
    let stereographic = 2.0 * min(across / twice_squared, MAX_STEREOGRAPHIC);
    let radial = vec4f(angle, equisolid, stereographic, select(1.0, across, dir.z < 0.0));
    let side = vec2f(dir.x, -dir.y) / max(across, 1e-6);
    return unwrap.center + unwrap.focal * side * dot(radial, unwrap.lens);
}

/// Visibility of a direction, 0…1: falls off towards the edge of the lens's field of view and of the frame.
fn visibility_in_lens(dir: vec3f, pixel: vec2f) -> f32 {
    let inside = unwrap.half_fov - angle_of(vec2f(-dir.z, length(dir.xy)));
    let soft = SOFT_PIXELS * unwrap.half_fov / min(unwrap.focal.x, unwrap.focal.y);
    return clamp(inside / soft, 0.0, 1.0) * inside_frame(pixel);
}
#else ifdef EQUIRECT
/// Pixel that shows a direction: columns from −Z towards +X, rows from +Y down.
fn frame_point(dir: vec3f) -> vec2f {
    let azimuth = angle_of(vec2f(-dir.z, dir.x)) / (2.0 * PI);
    let polar = angle_of(vec2f(dir.y, length(dir.xz))) / PI;
    return unwrap.focal * vec2f(azimuth - floor(azimuth), polar);
}

/// Visibility of a direction: all are visible.
fn visibility_in_lens(dir: vec3f, pixel: vec2f) -> f32 {
    return 1.0;
}
#else
/// Pixel of an orthographic image of a ball that shows a direction, from the half vector.
fn frame_point(dir: vec3f) -> vec2f {
    let sum = dir + vec3f(0.0, 0.0, unwrap.wrap);
    let half_vector = sum / max(length(sum), 1e-4);
    return unwrap.center + unwrap.focal * vec2f(half_vector.x, -half_vector.y);
}

/// Visibility of a direction, 0…1: falls off towards the outline of the ball and the frame's border.
fn visibility_in_lens(dir: vec3f, pixel: vec2f) -> f32 {
    let from_center = length((pixel - unwrap.center) / unwrap.focal);
    let sum = dir.z + unwrap.wrap;
    let inside = (1.0 - from_center) * min(unwrap.focal.x, unwrap.focal.y) / SOFT_PIXELS;
    return clamp(inside + 0.5, 0.0, 1.0) * inside_frame(pixel) * select(0.0, 1.0, sum > 0.0);
}
#endif

/// Observation of the direction at a position on a cube face; `step` is the distance between texels.
fn observe(face: u32, p: vec2f, step: f32) -> Observation {
    let dir_world = world_direction(face, p);
    let dir = unwrap.camera_from_world * dir_world;
    let pixel = frame_point(dir);
    var right = frame_point(unwrap.camera_from_world * world_direction(face, p + vec2f(step, 0.0))) - pixel;
    var down = frame_point(unwrap.camera_from_world * world_direction(face, p + vec2f(0.0, step))) - pixel;
#ifdef EQUIRECT
    // Differences across the seam take the shorter way around.
    right.x -= unwrap.focal.x * round(right.x / unwrap.focal.x);
    down.x -= unwrap.focal.x * round(down.x / unwrap.focal.x);
#endif
    var seen: Observation;
    let texel = mat2x2f(right, down);
    // The gain of a second camera holds for all of its light, not only for what is clipped.
    seen.radiance = mean_of_frame(pixel, texel, vec3f(1.0), SHARP) * unwrap.gain.rgb;
    seen.resolution = clamp(sqrt(abs(determinant(texel))), MIN_CONFIDENCE, 1.0);
    seen.visibility = visibility_in_lens(dir, pixel);
    seen.guess_quality = 0.0;
    return seen;
}
