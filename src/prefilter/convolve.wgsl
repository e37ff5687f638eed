// Full sums over blocks: the diffuse map and the rough levels of the specular map, as Bevy's EnvironmentMapLight reads
// them. The double-precision reference is in tests/environment/filter_truth.rs.
//
// Definitions: COSINE: lobes are powers of the cosine instead of GGX.

#import bevy_mirrorball::environment_map::cubemap::{face_direction, face_position, relative_angle}
#import bevy_mirrorball::prefilter::padded_faces::edge_without_padding
#import bevy_mirrorball::luminance::luminance

const PI: f32 = 3.14159265358979;

/// Part of the sphere, which counts as light from one direction.
struct Block {
    /// Radiance × solid angle; w: the solid angle.
    light: vec4f,
    /// Mean direction, weighted by luminance; shorter than 1 where the light is spread. w: half the width of that
    /// spread.
    centroid: vec4f,
}

/// The environment cube or a level of its pyramid.
@group(0) @binding(0) var source: texture_2d_array<f32>;
/// Solid angles of the blocks of a face in steradians, row by row, computed on the CPU in double precision.
@group(0) @binding(1) var<uniform> block_angles: array<vec4f, 16>;
@group(0) @binding(2) var<storage, read_write> gathered: array<Block>;
/// The gathered blocks, as a uniform: all threads of a sum read the same block at a time, so it is fetched once for
/// many.
@group(0) @binding(3) var<uniform> blocks: array<Block, 384>;
@group(0) @binding(4) var output: texture_storage_2d_array<rgba16float, write>;
/// Square of the perceptual roughness.
@group(0) @binding(5) var<uniform> alpha: f32;

/// Blocks along a cube edge.
const BLOCK_EDGE: u32 = 8u;

/// Light and centroid of each block. One thread per block.
@compute @workgroup_size(8, 8, 1)
fn gather_blocks(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(BLOCK_EDGE)) {
        return;
    }
    let edge = edge_without_padding(textureDimensions(source).x);
    let padding = (textureDimensions(source).x - edge) / 2u;
    let step = max(edge / BLOCK_EDGE, 1u);
    var light = vec3f(0.0);
    var moment = vec3f(0.0);
    var plain = vec3f(0.0);
    var angle_sum = 0.0;
    var weight_sum = 0.0;
    for (var i = 0u; i < step * step; i++) {
        let texel = min(id.xy * step + vec2u(i % step, i / step), vec2u(edge - 1u));
        let radiance = textureLoad(source, texel + padding, id.z, 0).rgb;
        let position = face_position(texel, edge);
        let dir = face_direction(id.z, position);
        let angle = relative_angle(position);
        let energy = luminance(radiance) * angle;
        light += radiance * angle;
        moment += dir * energy;
        plain += dir * angle;
        angle_sum += angle;
        weight_sum += energy;
    }
    let solid_angle = block_angles[2u * id.y + id.x / 4u][id.x % 4u];
    light *= solid_angle / angle_sum;
    let centroid = select(plain / angle_sum, moment / max(weight_sum, 1e-20), weight_sum > 1e-20);
    // The mean of unit vectors that are spread evenly over ±w along two axes has the squared length 1 − 2w²/3.
    let spread = sqrt(max(1.5 * (1.0 - dot(centroid, centroid)), 1e-12));
    gathered[(id.z * BLOCK_EDGE + id.y) * BLOCK_EDGE + id.x] =
        Block(vec4f(light, solid_angle), vec4f(centroid, spread));
}

/// Texels in a row that one thread of a sum computes, so that a block is fetched once for all of them.
const QUAD: u32 = 4u;

/// First texel of a thread.
fn quad_start(thread: u32, edge: u32) -> vec2u {
    let per_row = edge / QUAD;
    return vec2u(thread % per_row * QUAD, thread / per_row);
}

/// Normals of a quad: one column for each of x, y and z.
fn quad_normals(start: vec2u, face: u32, edge: u32) -> mat3x4f {
    return transpose(mat4x3f(
        face_direction(face, face_position(start, edge)),
        face_direction(face, face_position(start + vec2u(1u, 0u), edge)),
        face_direction(face, face_position(start + vec2u(2u, 0u), edge)),
        face_direction(face, face_position(start + vec2u(3u, 0u), edge)),
    ));
}

/// Mean of the absolute cosine over a block. A block on the horizon is partly above and partly below it.
fn mean_absolute_cosine(cosine: vec4f, spread: f32) -> vec4f {
    let inside = min(abs(cosine), vec4f(spread));
    return max(abs(cosine), vec4f(spread)) - 0.5 * spread + inside * inside * (0.5 / spread);
}

/// Texel in the opposite direction, on the face after this one.
fn antipode(texel: vec2u, face: u32, edge: u32) -> vec2u {
    return select(vec2u(texel.x, edge - 1u - texel.y), vec2u(edge - 1u - texel.x, texel.y), face == 2u);
}

/// Diffuse map: irradiance ÷ π, the cosine-weighted sum of all blocks. The positive part of a cosine is half the
/// cosine plus half its absolute value, so that two opposite directions share one sum. One thread per quad and its
/// opposite.
@compute @workgroup_size(64, 1, 1)
fn diffuse(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    let start = quad_start(id.x, edge);
    if start.y >= edge {
        return;
    }
    let face = id.z * 2u;
    let normals = quad_normals(start, face, edge);
    // One column for each of red, green and blue.
    var odd = mat3x4f(vec4f(), vec4f(), vec4f());
    var even = mat3x4f(vec4f(), vec4f(), vec4f());
    for (var i = 0u; i < 6u * BLOCK_EDGE * BLOCK_EDGE; i++) {
        let light = blocks[i].light;
        let centroid = blocks[i].centroid;
        let cosine = normals * centroid.xyz;
        let size = mean_absolute_cosine(cosine, centroid.w);
        odd += mat3x4f(light.r * cosine, light.g * cosine, light.b * cosine);
        even += mat3x4f(light.r * size, light.g * size, light.b * size);
    }
    var ahead = transpose(even + odd);
    var behind = transpose(even - odd);
    for (var i = 0u; i < QUAD; i++) {
        let texel = start + vec2u(i, 0u);
        textureStore(output, texel, face, vec4f(max(ahead[i], vec3f(0.0)) * (0.5 / PI), 1.0));
        let opposite = antipode(texel, face, edge);
        textureStore(output, opposite, face + 1u, vec4f(max(behind[i], vec3f(0.0)) * (0.5 / PI), 1.0));
    }
}

/// Change of alpha² per squared spread of a block. The kernel is narrower by what the blocks and the reader's
/// interpolation widen. Measured.
const SHARPENING: f32 = -0.5;
/// The same for the reciprocal of the exponent of a cosine, which the blocks narrow: what of them is below the horizon
/// does not count. Measured.
const COSINE_SHARPENING: f32 = 0.1;

#ifdef COSINE
/// Weights of a block: the power of the cosine that `SpecularLobe::exponent` says, for the part of the block above the
/// horizon.
fn lobe_weights(cosine: vec4f, spread: f32) -> vec4f {
    let own = 2.0 * alpha * alpha / (1.0 + alpha * alpha);
    let exponent = 1.0 / max(own + COSINE_SHARPENING * spread * spread, 0.5 * own);
    return pow(max(0.5 * (cosine + mean_absolute_cosine(cosine, spread)), vec4f(1e-6)), vec4f(exponent));
}
#else
/// Weights of a block. With normal = view, GGX depends on the cosine to the light alone, since the half vector bisects
/// the angle.
fn lobe_weights(cosine: vec4f, spread: f32) -> vec4f {
    let own = alpha * alpha;
    let width = max(own + SHARPENING * spread * spread, 0.5 * own);
    let d = 0.5 * (width - 1.0) * (1.0 + cosine) + 1.0;
    return (cosine + mean_absolute_cosine(cosine, spread)) * width / (d * d);
}
#endif

/// Rough level of the specular map, for lobes wider than a block: the full sum. One thread per quad, face after face,
/// because the last levels have few.
@compute @workgroup_size(64, 1, 1)
fn specular_sum(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    let per_face = edge * edge / QUAD;
    let face = id.x / per_face;
    if face >= 6u {
        return;
    }
    let start = quad_start(id.x % per_face, edge);
    let normals = quad_normals(start, face, edge);
    var sum = mat3x4f(vec4f(), vec4f(), vec4f());
    var weight_sum = vec4f(0.0);
    for (var i = 0u; i < 6u * BLOCK_EDGE * BLOCK_EDGE; i++) {
        let light = blocks[i].light;
        let centroid = blocks[i].centroid;
        let weight = lobe_weights(normals * centroid.xyz, centroid.w);
        sum += mat3x4f(light.r * weight, light.g * weight, light.b * weight);
        weight_sum += light.w * weight;
    }
    var means = transpose(sum);
    for (var i = 0u; i < QUAD; i++) {
        textureStore(output, start + vec2u(i, 0u), face, vec4f(max(means[i], vec3f(0.0)) / weight_sum[i], 1.0));
    }
}
