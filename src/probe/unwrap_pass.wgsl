// Camera picture of a mirrored ball → environment cube.

#import bevy_mirrorball::probe::mirror_ball::{Ball, side_of, surface_point}

/// Mirror of `UnwrapUniform` in unwrap_pass.rs.
struct Unwrap {
    ball: Ball,
    /// Rotation from world to camera space.
    camera_from_world: mat3x3f,
    /// Focal lengths and principal point in pixels.
    focal: vec2f,
    center: vec2f,
    /// Factor on pixels clipped by light from straight above the marker's paper; w: 1 if `uniform_radiance` replaces the picture.
    gain: vec4f,
    /// Normal of the marker's paper, camera space.
    up_camera: vec3f,
    /// Largest factor between a clipped channel and the brightest other one.
    most_saturation: f32,
    /// Luminance from which a pixel with a clipped channel is clipped in all.
    white_from: f32,
    uniform_radiance: vec3f,
    /// Linear values from here on are clipped.
    clipped_from: f32,
    /// 1 if `clip_gains` replaces `gain`.
    gains_by_direction: f32,
}

@group(0) @binding(0) var frame: texture_2d<f32>;
@group(0) @binding(1) var<uniform> unwrap: Unwrap;
/// Factor on clipped pixels towards each cell of a cube.
@group(0) @binding(2) var<storage, read> clip_gains: array<vec4f>;
@group(0) @binding(3) var cube: texture_storage_2d_array<rgba16float, write>;

const PI: f32 = 3.14159265358979;
/// Lookups per texel along each axis.
const SUBSAMPLES: u32 = 2u;
/// Cells along an edge of the cube of gains, `ClipGains::EDGE`.
const GAINS_EDGE: u32 = 32u;
/// Directions around the hidden cone that its middle is the mean of.
const RING: u32 = 8u;
/// The largest value stored; far below the 65504 of half floats, so that sums of a few texels still fit.
const MAX_RADIANCE: f32 = 60000.0;

/// A pixel with its clipped channels multiplied, but none beyond what its other channels make likely. Twin of `gain_limits`
/// in recovery.rs.
fn recovered(pixel: vec2i, gain: vec3f) -> vec3f {
    let size = vec2i(textureDimensions(frame));
    let value = textureLoad(frame, clamp(pixel, vec2i(0), size - 1), 0).rgb;
    let is_clipped = value >= vec3f(unwrap.clipped_from);
    if !any(is_clipped) {
        return value;
    }
    if dot(value, vec3f(0.2126, 0.7152, 0.0722)) >= unwrap.white_from {
        return value * gain;
    }
    let unclipped = select(value, vec3f(0.0), is_clipped);
    let most = unwrap.most_saturation * max(unclipped.r, max(unclipped.g, unclipped.b));
    return select(value, clamp(value * gain, value, max(vec3f(most), value)), is_clipped);
}

/// Bilinear lookup; the gain is applied to each pixel, before pixels are mixed.
fn sample_frame(pos_camera: vec3f, gain: vec3f) -> vec3f {
    let pixel = unwrap.center + unwrap.focal * vec2f(pos_camera.x, -pos_camera.y) / -pos_camera.z;
    let corner = floor(pixel - 0.5);
    let t = pixel - 0.5 - corner;
    let p = vec2i(corner);
    let top = mix(recovered(p, gain), recovered(p + vec2i(1, 0), gain), t.x);
    let bottom = mix(recovered(p + vec2i(0, 1), gain), recovered(p + vec2i(1, 1), gain), t.x);
    return mix(top, bottom, t.y);
}

/// Place of a world direction among the gains. Twin of `cell_index` in lighting/sky.rs.
fn sky_cell(dir: vec3f) -> u32 {
    let size = abs(dir);
    var along = dir.zxy;
    var axis = 2u;
    if size.x >= size.y && size.x >= size.z {
        along = dir;
        axis = 0u;
    } else if size.y >= size.z {
        along = dir.yxz;
        axis = 1u;
    }
    let face = 2u * axis + select(0u, 1u, along.x < 0.0);
    let p = vec2u((along.yz / abs(along.x) * 0.5 + 0.5) * f32(GAINS_EDGE));
    let cell = min(p, vec2u(GAINS_EDGE - 1u));
    return (face * GAINS_EDGE + cell.y) * GAINS_EDGE + cell.x;
}

fn radiance_from(dir_world: vec3f) -> vec3f {
    let ball = unwrap.ball;
    let dir = unwrap.camera_from_world * dir_world;
    let axis = -normalize(ball.center_camera);
    let side = side_of(axis, dir);
    let angle = atan2(length(dir - axis * dot(axis, dir)), dot(axis, dir));
    // The least extra light that explains the paper: proportional to how much of it the paper catches, none from below.
    let gain_by_paper = 1.0 + (unwrap.gain.rgb - 1.0) * max(dot(dir, unwrap.up_camera), 0.0);
    let gain = select(gain_by_paper, clip_gains[sky_cell(dir_world)].rgb, unwrap.gains_by_direction > 0.5);
    let measured = sample_frame(surface_point(ball, axis, side, min(angle, ball.edge_angle)), gain);
    if angle <= ball.edge_angle {
        return measured;
    }
    // Hidden: from the rim on this side to the mean of the ring in the middle of the gap.
    let other = cross(axis, side);
    var ring = vec3f(0.0);
    for (var i = 0u; i < RING; i++) {
        let azimuth = 2.0 * PI * f32(i) / f32(RING);
        let rim = side * cos(azimuth) + other * sin(azimuth);
        ring += sample_frame(surface_point(ball, axis, rim, ball.edge_angle), gain);
    }
    return mix(measured, ring / f32(RING), (angle - ball.edge_angle) / (PI - ball.edge_angle));
}

/// World direction of a position (-1…1) on a cube face. Lookups negate z, so the faces are stored mirrored in z.
fn face_direction(face: u32, p: vec2f) -> vec3f {
    var dir: vec3f;
    switch face {
        case 0u: { dir = vec3f(1.0, -p.y, -p.x); }
        case 1u: { dir = vec3f(-1.0, -p.y, p.x); }
        case 2u: { dir = vec3f(p.x, 1.0, p.y); }
        case 3u: { dir = vec3f(p.x, -1.0, -p.y); }
        case 4u: { dir = vec3f(p.x, -p.y, 1.0); }
        default: { dir = vec3f(-p.x, -p.y, -1.0); }
    }
    return normalize(dir) * vec3f(1.0, 1.0, -1.0);
}

@compute @workgroup_size(8, 8, 1)
fn unwrap_ball(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(cube);
    if id.x >= size.x || id.y >= size.y {
        return;
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < SUBSAMPLES * SUBSAMPLES; i++) {
        let offset = (vec2f(vec2u(i % SUBSAMPLES, i / SUBSAMPLES)) + 0.5) / f32(SUBSAMPLES);
        let p = 2.0 * (vec2f(id.xy) + offset) / vec2f(size) - 1.0;
        sum += radiance_from(face_direction(id.z, p));
    }
    sum /= f32(SUBSAMPLES * SUBSAMPLES) * unwrap.ball.reflectance;
    // A select, no branch: software Vulkan compiles a shader that branches on a uniform anew for every dispatch.
    sum = select(sum, unwrap.uniform_radiance, unwrap.gain.w > 0.5);
    textureStore(cube, id.xy, id.z, vec4f(min(sum, vec3f(MAX_RADIANCE)), 1.0));
}
