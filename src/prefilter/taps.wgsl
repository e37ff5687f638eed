// Rings of taps: the sharp levels of the specular map. The double-precision reference is in tests/filter_truth.
//
// INNER_TAPS, MIDDLE_TAPS, OUTER_TAPS: taps of each ring, for `specular_taps`.

#import bevy_mirrorball::environment_map::cubemap::{
    face_direction, face_position, place_of, relative_angle, sample_faces,
}
#import bevy_mirrorball::prefilter::padded_faces::{edge_without_padding, padded_place, padded_texel, padded_uv}

const PI: f32 = 3.14159265358979;

/// Mirror of `TapsUniform` in lobe.rs.
struct Taps {
    /// Of each tap, ring by ring; w: of the next rougher level.
    weights: vec4f,
    /// Directions relative to the normal (z), ring after ring.
    offsets: array<vec4f, 24>,
}

@group(0) @binding(0) var face_sampler: sampler;
/// Neighboring levels of the pyramid, each coarser than the one before.
@group(0) @binding(1) var level_0: texture_2d_array<f32>;
@group(0) @binding(2) var level_1: texture_2d_array<f32>;
@group(0) @binding(3) var level_2: texture_2d_array<f32>;
/// Level of the pyramid in the mean over a face, and the last one, counted from `level_0`.
@group(0) @binding(4) var<uniform> sharpness: vec2f;
@group(0) @binding(5) var output: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(6) var<uniform> taps: Taps;
/// Next rougher level of the specular map.
@group(0) @binding(7) var rougher: texture_2d_array<f32>;
/// What the taps of each ring read: the pyramid, equally sharp everywhere, padded.
@group(0) @binding(8) var inner: texture_2d_array<f32>;
@group(0) @binding(9) var middle: texture_2d_array<f32>;
@group(0) @binding(10) var outer: texture_2d_array<f32>;

/// The pyramid as faces whose texels all cover the same angle, whatever their place on the face. One ring of taps reads it without
/// a look at levels, and its second interpolation evens out where between texels a small lamp lies.
@compute @workgroup_size(64, 1, 1)
fn equalize(@builtin(global_invocation_id) id: vec3u) {
    let padded_edge = textureDimensions(output).x;
    let texel = padded_texel(id.x, padded_edge);
    if texel.y >= padded_edge {
        return;
    }
    let place = padded_place(id.z, texel, edge_without_padding(padded_edge));
    // Texels are smaller towards the corners of a face: (2 ÷ edge)² times this, where π ÷ 6 is the mean.
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
/// Taps of each ring: what is known beforehand is unrolled, which software Vulkan runs twice as fast.
const INNER_END: u32 = #{INNER_TAPS}u;
const MIDDLE_END: u32 = INNER_END + #{MIDDLE_TAPS}u;
const OUTER_END: u32 = MIDDLE_END + #{OUTER_TAPS}u;

/// Sum over the taps from one place to another.
fn ring(faces: texture_2d_array<f32>, start: u32, end: u32, axes: mat3x3f) -> vec3f {
    var sum = vec3f(0.0);
    for (var i = start; i < end; i++) {
        let place = place_of(axes * taps.offsets[i].xyz);
        sum += lookup(faces, place.face, place.position);
    }
    return sum;
}

/// Radiance seen in a smooth GGX surface from straight above (normal = view): rings of taps, whose weights are fitted to the lobe
/// (lobe.rs), and the next rougher level as its tail.
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
