// Environment cube → irradiance and glossy maps, as Bevy's EnvironmentMapLight reads them. The double-precision
// reference is in tests/environment/filter_truth.rs.
//
// Definitions: INNER_TAPS, MIDDLE_TAPS, OUTER_TAPS for `glossy_taps`; COPIES for a `halve` that copies the source, too.

#import bevy_mirrorball::environment_map::cubemap::{
    FaceTexel, edge_without_padding, face_direction, face_position, face_vector, is_own_texel, is_padding_corner, padded_place,
    padded_texel, padded_uv, place_of, relative_angle, sample_faces, texels_at_corner,
}
#import bevy_mirrorball::trigonometry::angle_of

const PI: f32 = 3.14159265358979;
/// Largest 16-bit float.
const MAX_HALF: f32 = 65504.0;

// --- reduce: one level of the pyramid from the level above it. Levels are padded ------------------------------------

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(3) var face_sampler: sampler;

/// Mean of four texels, weighted by the solid angle they cover: the first level, half as wide as the source. In the corners of
/// the padding it is the mean of the three texels that meet there.
fn halved(face: u32, padded: vec2u) -> vec3f {
    let edge = textureDimensions(finer).x / 2u;
    let place = padded_place(face, padded, edge);
    let is_corner = is_padding_corner(padded, edge);
    let first = vec2i((place.position * 0.5 + 0.5) * f32(edge)) * 2;
    let at_corner = texels_at_corner(face_vector(face, place.position), i32(2u * edge));
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        var found = FaceTexel(place.face, first + vec2i(vec2u(i & 1u, i >> 1u)));
        found.face = select(found.face, at_corner[min(i, 2u)].face, is_corner);
        found.texel = select(found.texel, at_corner[min(i, 2u)].texel, is_corner);
        let weight = select(relative_angle(face_position(vec2u(found.texel), 2u * edge)), f32(i < 3u), is_corner);
        let radiance = textureLoad(finer, found.texel, found.face, 0).rgb;
#ifdef COPIES
        // Roughness 0 of the glossy map, where that is as large as the source: each texel is read once for both.
        if is_own_texel(padded, edge) {
            textureStore(output, found.texel, found.face, vec4f(radiance, 1.0));
        }
#endif
        sum += radiance * weight;
        weight_sum += weight;
    }
    return sum / weight_sum;
}

@compute @workgroup_size(64, 1, 1)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    let texel = padded_texel(id.x, textureDimensions(coarser).x);
    if texel.y >= textureDimensions(coarser).y {
        return;
    }
    textureStore(coarser, texel, id.z, vec4f(halved(id.z, texel), 1.0));
}

/// The other levels are splines: sixteen texels of the level above with the weights 1 3 3 1 along each side, by four bilinear
/// lookups. A small light then fades from texel to texel as it moves (after Manson & Sloan 2016).
@compute @workgroup_size(64, 1, 1)
fn smooth_halve(@builtin(global_invocation_id) id: vec3u) {
    let padded_edge = textureDimensions(coarser).x;
    let texel = padded_texel(id.x, padded_edge);
    if texel.y >= padded_edge {
        return;
    }
    let edge = edge_without_padding(padded_edge);
    let center = padded_place(id.z, texel, edge);
    // Three quarters of a finer texel; at a corner nothing lies beyond it.
    let offset = select(0.75 / f32(edge), 0.0, is_padding_corner(texel, edge));
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let position = center.position + offset * (2.0 * vec2f(vec2u(i & 1u, i >> 1u)) - 1.0);
        let weight = relative_angle(position);
        let uv = padded_uv(position, textureDimensions(finer).x);
        sum += textureSampleLevel(finer, face_sampler, uv, center.face, 0.0).rgb * weight;
        weight_sum += weight;
    }
    textureStore(coarser, texel, id.z, vec4f(sum / weight_sum, 1.0));
}

// --- convolve --------------------------------------------------------------------------------------------------------

/// Mirror of `TapsUniform` in filter_maker.rs.
struct Taps {
    /// Of each tap, ring by ring; w: of the next rougher level.
    shares: vec4f,
    /// Directions relative to the normal (z), ring after ring.
    places: array<vec4f, 24>,
}

/// Part of the sphere, as light from one direction.
struct Block {
    /// Radiance × solid angle; w: the solid angle.
    light: vec4f,
    /// Mean direction weighted by luminance, shorter than 1 where the light is spread; w: half the width of that spread.
    centroid: vec4f,
}

/// Neighboring levels of the pyramid, each coarser than the one before.
@group(0) @binding(4) var level_0: texture_2d_array<f32>;
@group(0) @binding(20) var level_1: texture_2d_array<f32>;
@group(0) @binding(21) var level_2: texture_2d_array<f32>;
/// What the taps of each ring read: the pyramid, equally sharp everywhere, padded.
@group(0) @binding(15) var inner: texture_2d_array<f32>;
@group(0) @binding(16) var middle: texture_2d_array<f32>;
@group(0) @binding(17) var outer: texture_2d_array<f32>;
/// Level of the pyramid in the mean over a face, and the last one, counted from `level_0`.
@group(0) @binding(18) var<uniform> sharpness: vec2f;
@group(0) @binding(5) var output: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(6) var<uniform> taps: Taps;
@group(0) @binding(7) var rougher: texture_2d_array<f32>;
@group(0) @binding(8) var<storage, read_write> blocks: array<Block>;
/// Solid angles of the blocks of a face in steradian, row by row; from the CPU, in double precision.
@group(0) @binding(19) var<uniform> block_angles: array<vec4f, 16>;
/// The same for the sums, which all read one block at a time: as a uniform that is read once for many threads.
@group(0) @binding(14) var<uniform> summands: array<Block, 384>;
/// GGX's alpha, the square of the perceptual roughness.
@group(0) @binding(12) var<uniform> alpha: f32;

/// Blocks along a cube edge.
const BLOCK_EDGE: u32 = 8u;

/// One thread per block: its light and where that comes from.
@compute @workgroup_size(8, 8, 1)
fn gather_blocks(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(BLOCK_EDGE)) {
        return;
    }
    let edge = edge_without_padding(textureDimensions(finer).x);
    let padding = (textureDimensions(finer).x - edge) / 2u;
    let step = max(edge / BLOCK_EDGE, 1u);
    var light = vec3f(0.0);
    var moment = vec3f(0.0);
    var plain = vec3f(0.0);
    var angle_sum = 0.0;
    var weight_sum = 0.0;
    for (var i = 0u; i < step * step; i++) {
        let texel = min(id.xy * step + vec2u(i % step, i / step), vec2u(edge - 1u));
        let radiance = textureLoad(finer, texel + padding, id.z, 0).rgb;
        let position = face_position(texel, edge);
        let dir = face_direction(id.z, position);
        let angle = relative_angle(position);
        let luminance = dot(radiance, vec3f(0.2126, 0.7152, 0.0722)) * angle;
        light += radiance * angle;
        moment += dir * luminance;
        plain += dir * angle;
        angle_sum += angle;
        weight_sum += luminance;
    }
    let solid_angle = block_angles[2u * id.y + id.x / 4u][id.x % 4u];
    light *= solid_angle / angle_sum;
    let centroid = select(plain / angle_sum, moment / max(weight_sum, 1e-20), weight_sum > 1e-20);
    // Evenly spread over ±w along each of two axes, unit vectors have a mean of squared length 1 − 2w²/3.
    let spread = sqrt(max(1.5 * (1.0 - dot(centroid, centroid)), 1e-12));
    blocks[(id.z * BLOCK_EDGE + id.y) * BLOCK_EDGE + id.x] = Block(vec4f(light, solid_angle), vec4f(centroid, spread));
}

/// Texels in a row that one thread of the sums works on, so that a block is fetched once for all of them.
const QUAD: u32 = 4u;

/// The place of a thread's first texel.
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

/// Mean of the absolute cosine over a block: one on the horizon is partly above and partly below.
fn mean_absolute_cosine(cosine: vec4f, spread: f32) -> vec4f {
    let inside = min(abs(cosine), vec4f(spread));
    return max(abs(cosine), vec4f(spread)) - 0.5 * spread + inside * inside * (0.5 / spread);
}

/// The texel in the opposite direction, on the face after this one.
fn antipode(texel: vec2u, face: u32, edge: u32) -> vec2u {
    return select(vec2u(texel.x, edge - 1u - texel.y), vec2u(edge - 1u - texel.x, texel.y), face == 2u);
}

/// Irradiance ÷ π for each direction of the output: the cosine-weighted sum of all blocks. The positive part of a cosine is
/// half the cosine and half its absolute value, so that two opposite directions share one sum. One thread per quad and its
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
    // Red, green and blue of each texel.
    var odd = mat3x4f(vec4f(), vec4f(), vec4f());
    var even = mat3x4f(vec4f(), vec4f(), vec4f());
    for (var i = 0u; i < 6u * BLOCK_EDGE * BLOCK_EDGE; i++) {
        let light = summands[i].light;
        let centroid = summands[i].centroid;
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

/// Roughness 0: the source itself, or the level of the pyramid that is as large.
@compute @workgroup_size(8, 8, 1)
fn sharpest(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let padding = (textureDimensions(finer).x - edge) / 2u;
    textureStore(output, id.xy, id.z, vec4f(textureLoad(finer, id.xy + padding, id.z, 0).rgb, 1.0));
}

/// The pyramid as faces whose texels all cover the same angle, whatever their place on the face. One ring of taps reads it without
/// a look at levels, and its second interpolation evens out where between texels a small lamp lies.
@compute @workgroup_size(64, 1, 1)
fn even_out(@builtin(global_invocation_id) id: vec3u) {
    let padded_edge = textureDimensions(output).x;
    let texel = padded_texel(id.x, padded_edge);
    if texel.y >= padded_edge {
        return;
    }
    let place = padded_place(id.z, texel, edge_without_padding(padded_edge));
    // Texels are smaller towards the corners of a face: (2 ÷ edge)² times this, where π ÷ 6 is the mean.
    let correction = -0.5 * log2(relative_angle(place.position) * (6.0 / PI));
    let level = clamp(sharpness.x + correction, 0.0, sharpness.y);
    let share = max(1.0 - abs(level - vec3f(0.0, 1.0, 2.0)), vec3f(0.0));
    let radiance = share.x * look(level_0, place.face, place.position)
        + share.y * look(level_1, place.face, place.position)
        + share.z * look(level_2, place.face, place.position);
    textureStore(output, texel, id.z, vec4f(radiance, 1.0));
}

/// Bilinear lookup in padded faces.
fn look(faces: texture_2d_array<f32>, face: u32, position: vec2f) -> vec3f {
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
        let place = place_of(axes * taps.places[i].xyz);
        sum += look(faces, place.face, place.position);
    }
    return sum;
}

/// Radiance seen in a smooth GGX surface from straight above (normal = view): rings of taps, whose shares are fitted to the lobe
/// (lobe.rs), and the next rougher level as its tail.
@compute @workgroup_size(8, 8, 1)
fn glossy_taps(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let normal = face_direction(id.z, face_position(id.xy, edge));
    let tangent = normalize(cross(normal, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.y) < 0.7)));
    let axes = mat3x3f(tangent, cross(normal, tangent), normal);
    var sum = sample_faces(rougher, normal, 0u).rgb * taps.shares.w;
    sum += ring(inner, 0u, INNER_END, axes) * taps.shares.x;
    sum += ring(middle, INNER_END, MIDDLE_END, axes) * taps.shares.y;
    sum += ring(outer, MIDDLE_END, OUTER_END, axes) * taps.shares.z;
    textureStore(output, id.xy, id.z, vec4f(sum, 1.0));
}
#endif

/// Added to alpha², times the squared spread of a block: what the blocks and the reader's interpolation widen, the kernel is
/// narrower. Measured.
const SHARPENING: f32 = -0.5;

/// As `glossy_taps`, for lobes wider than a block: the whole sum. For normal = view, GGX depends on the cosine to the light
/// alone, since the half vector bisects the angle. One thread per quad, face after face: the last levels have few.
@compute @workgroup_size(64, 1, 1)
fn glossy_sum(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    let per_face = edge * edge / QUAD;
    let face = id.x / per_face;
    if face >= 6u {
        return;
    }
    let start = quad_start(id.x % per_face, edge);
    let normals = quad_normals(start, face, edge);
    let own = alpha * alpha;
    var sum = mat3x4f(vec4f(), vec4f(), vec4f());
    var weight_sum = vec4f(0.0);
    for (var i = 0u; i < 6u * BLOCK_EDGE * BLOCK_EDGE; i++) {
        let light = summands[i].light;
        let centroid = summands[i].centroid;
        let cosine = normals * centroid.xyz;
        let width = max(own + SHARPENING * centroid.w * centroid.w, 0.5 * own);
        let d = 0.5 * (width - 1.0) * (1.0 + cosine) + 1.0;
        let weight = (cosine + mean_absolute_cosine(cosine, centroid.w)) * width / (d * d);
        sum += mat3x4f(light.r * weight, light.g * weight, light.b * weight);
        weight_sum += light.w * weight;
    }
    var means = transpose(sum);
    for (var i = 0u; i < QUAD; i++) {
        textureStore(output, start + vec2u(i, 0u), face, vec4f(max(means[i], vec3f(0.0)) / weight_sum[i], 1.0));
    }
}

// --- resample: other sources → cube of a power of two ----------------------------------------------------------------

@group(0) @binding(9) var equirect: texture_2d<f32>;
@group(0) @binding(10) var any_cube: texture_2d_array<f32>;

/// The eye relative to the point of capture, w: the desk's height relative to it. Zeros leave directions as they are.
@group(0) @binding(13) var<uniform> viewpoint: vec4f;

/// The direction (cube frame) in which the place that the eye sees in a direction was captured: what is below the horizon lies on
/// the desk, all else far away. Twin in parallax.rs.
fn captured_direction(dir: vec3f) -> vec3f {
    let above = viewpoint.y - viewpoint.w;
    // The cube's frame is left-handed: its +z is the world's −Z.
    let eye = viewpoint.xyz * vec3f(1.0, 1.0, -1.0);
    let shifted = dir * above + eye * max(-dir.y, 0.0);
    return select(dir, normalize(shifted), above > 0.0 && dot(shifted, shifted) > 1e-20);
}

/// Lookups along each side of a texel of the new cube.
const SUBSAMPLES: u32 = 4u;

fn subsample(texel: vec2u, edge: u32, i: u32) -> vec2f {
    let sub = vec2u(i % SUBSAMPLES, i / SUBSAMPLES);
    return face_position(texel * SUBSAMPLES + sub, edge * SUBSAMPLES);
}

/// An equirectangular picture laid out as in equirect.rs: bilinear lookups that wrap around and stop at the poles.
@compute @workgroup_size(8, 8, 1)
fn resample_equirect(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(coarser).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let size = vec2i(textureDimensions(equirect));
    var sum = vec3f(0.0);
    for (var i = 0u; i < SUBSAMPLES * SUBSAMPLES; i++) {
        // The cube's frame is left-handed: its +z is the world's −Z.
        let dir = captured_direction(face_direction(id.z, subsample(id.xy, edge, i)));
        let uv = vec2f(angle_of(dir.zx) / (2.0 * PI), angle_of(vec2f(dir.y, length(dir.xz))) / PI);
        let at = uv * vec2f(size) - 0.5;
        let low = floor(at);
        let t = at - low;
        let x = (vec2i(i32(low.x), i32(low.x) + 1) + size.x) % size.x;
        let y = clamp(vec2i(i32(low.y), i32(low.y) + 1), vec2i(0), vec2i(size.y - 1));
        let upper = mix(textureLoad(equirect, vec2i(x.x, y.x), 0).rgb, textureLoad(equirect, vec2i(x.y, y.x), 0).rgb, t.x);
        let lower = mix(textureLoad(equirect, vec2i(x.x, y.y), 0).rgb, textureLoad(equirect, vec2i(x.y, y.y), 0).rgb, t.x);
        sum += mix(upper, lower, t.y);
    }
    let mean = sum / f32(SUBSAMPLES * SUBSAMPLES);
    textureStore(coarser, id.xy, id.z, vec4f(clamp(mean, vec3f(0.0), vec3f(MAX_HALF)), 1.0));
}

/// A cube of any size.
@compute @workgroup_size(8, 8, 1)
fn resample_cube(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(coarser).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    var sum = vec3f(0.0);
    for (var i = 0u; i < SUBSAMPLES * SUBSAMPLES; i++) {
        let dir = captured_direction(face_direction(id.z, subsample(id.xy, edge, i)));
        sum += sample_faces(any_cube, dir, 0u).rgb;
    }
    let mean = sum / f32(SUBSAMPLES * SUBSAMPLES);
    textureStore(coarser, id.xy, id.z, vec4f(clamp(mean, vec3f(0.0), vec3f(MAX_HALF)), 1.0));
}
