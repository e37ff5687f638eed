// Rings of taps: the sharp levels of the specular map. The double-precision reference is in
// tests/environment/filter_truth.rs.
//
// INNER_TAPS, MIDDLE_TAPS, OUTER_TAPS: number of taps of each ring, for `specular_taps`.

#import bevy_mirrorball::environment_map::cubemap::{
    face_direction, face_position, place_of, relative_angle, sample_faces,
}
#import bevy_mirrorball::prefilter::padded_faces::{edge_without_padding, padded_place, padded_texel, padded_uv}

const PI: f32 = 3.14159265358979;

/// Mirror of `TapsUniform` in `lobe.rs`.
struct Taps {
    /// Weight of each tap of a ring, for up to three rings; w: weight of the next rougher level.
    weights: vec4f,
    /// Directions of the taps relative to the normal (z), ring after ring.
    offsets: array<vec4f, 24>,
}

@group(0) @binding(0) var face_sampler: sampler;
/// Neighboring levels of the pyramid, each coarser than the one before.
@group(0) @binding(1) var level_0: texture_2d_array<f32>;
@group(0) @binding(2) var level_1: texture_2d_array<f32>;
@group(0) @binding(3) var level_2: texture_2d_array<f32>;
/// Mean level of the pyramid over a face, and the last one that may be read, both counted from `level_0`.
@group(0) @binding(4) var<uniform> sharpness: vec2f;
@group(0) @binding(5) var output: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(6) var<uniform> taps: Taps;
/// Next rougher level of the specular map.
@group(0) @binding(7) var rougher: texture_2d_array<f32>;
/// Sources of the taps of each ring: the equalized pyramid, padded.
@group(0) @binding(8) var inner: texture_2d_array<f32>;
@group(0) @binding(9) var middle: texture_2d_array<f32>;
@group(0) @binding(10) var outer: texture_2d_array<f32>;

/// Source of one ring of taps: the pyramid, made equally sharp all over each face. Taps need not choose levels then,
/// and the second interpolation hides where between texels a small lamp lies.
@compute @workgroup_size(64, 1, 1)
fn equalize(@builtin(global_invocation_id) id: vec3u) {
    let padded_edge = textureDimensions(output).x;
    let texel = padded_texel(id.x, padded_edge);
    if texel.y >= padded_edge {
        return;
    }
    let place = padded_place(id.z, texel, edge_without_padding(padded_edge));
    // The solid angle of a texel is (2 ÷ edge)² times the relative angle, whose mean over a face is π ÷ 6.
    let correction = -0.5 * log2(relative_angle(place.position) * (6.0 / PI));
    let level = clamp(sharpness.x + correction, 0.0, sharpness.y);
    let weight = max(1.0 - abs(level - vec3f(0.0, 1.0, 2.0)), vec3f(0.0));
    let radiance = weight.x * lookup(level_0, place.face, place.position)
        + weight.y * lookup(level_1, place.face, place.position)
        + weight.z * lookup(level_2, place.face, place.position);
    textureStore(output, texel, id.z, vec4f(radiance, 1.0));
}

/// Bilinear lookup in padded faces.
fn lookup(faces: texture_2d_array<f32>, face: u32, position: vec2f) -> vec3f {
    return textureSampleLevel(faces, face_sampler, padded_uv(position, textureDimensions(faces).x), face, 0.0).rgb;
}

#ifdef INNER_TAPS
/// Ends of the rings. They are constants, so that loops are unrolled: software Vulkan then runs twice as fast.
const INNER_END: u32 = #{INNER_TAPS}u;
const MIDDLE_END: u32 = INNER_END + #{MIDDLE_TAPS}u;
const OUTER_END: u32 = MIDDLE_END + #{OUTER_TAPS}u;

/// Sum over the taps of a ring.
fn ring(faces: texture_2d_array<f32>, start: u32, end: u32, axes: mat3x3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = start; i < end; i++) {
        let place = place_of(axes * taps.offsets[i].xyz);
        sum += lookup(faces, place.face, place.position);
    }
    return sum;
}

/// Sharp level of the specular map: radiance that a GGX surface reflects straight up (normal = view). Rings of taps,
/// whose weights `lobe.rs` fits to the lobe, and the next rougher level as its tail.
@compute @workgroup_size(8, 8, 1)
fn specular_taps(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let normal = face_direction(id.z, face_position(id.xy, edge));
    let tangent = normalize(cross(normal, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.y) < 0.7)));
    let axes = mat3x3f(tangent, cross(normal, tangent), normal);
    var sum = sample_faces(rougher, normal, 0u).rgb * taps.weights.w;
    sum += ring(inner, 0u, INNER_END, axes) * taps.weights.x;
    sum += ring(middle, INNER_END, MIDDLE_END, axes) * taps.weights.y;
    sum += ring(outer, MIDDLE_END, OUTER_END, axes) * taps.weights.z;
    textureStore(output, id.xy, id.z, vec4f(sum, 1.0));
}
#endif
