// Equirectangular images and cubes of any size → cube with a power of two as edge length.

#import bevy_mirrorball::environment_map::cubemap::{face_direction, face_position, sample_faces}
#import bevy_mirrorball::trigonometry::angle_of

const PI: f32 = 3.14159265358979;
/// Largest 16-bit float.
const MAX_HALF: f32 = 65504.0;

@group(0) @binding(0) var cube: texture_storage_2d_array<rgba16float, write>;
/// Eye relative to the point of capture; w: the desk's height relative to it. Zeros leave directions unchanged.
@group(0) @binding(1) var<uniform> viewpoint: vec4f;
@group(0) @binding(2) var equirect: texture_2d<f32>;
@group(0) @binding(3) var any_cube: texture_2d_array<f32>;

/// Direction (cube frame) in which the point that the eye sees in a direction was captured. Points below the horizon
/// lie on the desk, all others far away. Twin of `captured_direction` in `parallax.rs`.
fn captured_direction(dir: vec3f) -> vec3f {
    let above = viewpoint.y - viewpoint.w;
    // The frame of a cube is left-handed: its +z is the world's −Z.
    let eye = viewpoint.xyz * vec3f(1.0, 1.0, -1.0);
    let shifted = dir * above + eye * max(-dir.y, 0.0);
    return select(dir, normalize(shifted), above > 0.0 && dot(shifted, shifted) > 1e-20);
}

/// Lookups along each side of a texel of the new cube.
const SUBSAMPLES: u32 = 4u;

/// Position of lookup number `i` of a texel on its face.
fn subsample(texel: vec2u, edge: u32, i: u32) -> vec2f {
    let sub = vec2u(i % SUBSAMPLES, i / SUBSAMPLES);
    return face_position(texel * SUBSAMPLES + sub, edge * SUBSAMPLES);
}

/// Cube from an equirectangular image, laid out as in `equirect.rs`. Bilinear lookups wrap around and clamp at the
/// poles.
@compute @workgroup_size(8, 8, 1)
fn resample_equirect(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(cube).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let size = vec2i(textureDimensions(equirect));
    var sum = vec3f(0.0);
    for (var i = 0u; i < SUBSAMPLES * SUBSAMPLES; i++) {
        // The frame of a cube is left-handed: its +z is the world's −Z.
        let dir = captured_direction(face_direction(id.z, subsample(id.xy, edge, i)));
        let uv = vec2f(angle_of(dir.zx) / (2.0 * PI), angle_of(vec2f(dir.y, length(dir.xz))) / PI);
        let at = uv * vec2f(size) - 0.5;
        let low = floor(at);
        let t = at - low;
        let x = (vec2i(i32(low.x), i32(low.x) + 1) + size.x) % size.x;
        let y = clamp(vec2i(i32(low.y), i32(low.y) + 1), vec2i(0), vec2i(size.y - 1));
        let upper = mix(
            textureLoad(equirect, vec2i(x.x, y.x), 0).rgb,
            textureLoad(equirect, vec2i(x.y, y.x), 0).rgb,
            t.x,
        );
        let lower = mix(
            textureLoad(equirect, vec2i(x.x, y.y), 0).rgb,
            textureLoad(equirect, vec2i(x.y, y.y), 0).rgb,
            t.x,
        );
        sum += mix(upper, lower, t.y);
    }
    let mean = sum / f32(SUBSAMPLES * SUBSAMPLES);
    textureStore(cube, id.xy, id.z, vec4f(clamp(mean, vec3f(0.0), vec3f(MAX_HALF)), 1.0));
}

/// Cube from a cube of any size.
@compute @workgroup_size(8, 8, 1)
fn resample_cube(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(cube).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < SUBSAMPLES * SUBSAMPLES; i++) {
        let dir = captured_direction(face_direction(id.z, subsample(id.xy, edge, i)));
        sum += sample_faces(any_cube, dir, 0u).rgb;
    }
    let mean = sum / f32(SUBSAMPLES * SUBSAMPLES);
    textureStore(cube, id.xy, id.z, vec4f(clamp(mean, vec3f(0.0), vec3f(MAX_HALF)), 1.0));
}
