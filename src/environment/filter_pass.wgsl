// Environment cube → irradiance and glossy maps, as Bevy's EnvironmentMapLight reads them. The double-precision
// reference is in tests/environment.rs.

const PI: f32 = 3.14159265358979;

// --- reduce: one level of the pyramid from the level above it -------------------------------------------------------

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<rgba16float, write>;

/// Mean of blocks of texels, weighted by the solid angle they cover. The finer level is a multiple of the coarser in size.
@compute @workgroup_size(8, 8, 1)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(coarser).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let finer_edge = textureDimensions(finer).x;
    let step = finer_edge / edge;
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < step * step; i++) {
        let texel = id.xy * step + vec2u(i % step, i / step);
        let weight = solid_angle(texel, finer_edge);
        sum += textureLoad(finer, texel, id.z, 0).rgb * weight;
        weight_sum += weight;
    }
    textureStore(coarser, id.xy, id.z, vec4f(sum / weight_sum, 1.0));
}

// --- convolve --------------------------------------------------------------------------------------------------------

/// Mirror of `ConvolveUniform` in filter_pass.rs.
struct Convolve {
    /// Perceptual roughness of the level that is written.
    roughness: f32,
    /// Lookups per texel.
    samples: u32,
    /// Edge length of the source in texels.
    source_edge: f32,
    /// Level of the pyramid that has half the source's edge length is 0; the coarsest one.
    coarsest_level: f32,
}

/// Part of the sphere, as light from one direction.
struct Block {
    /// Radiance × solid angle, and unused.
    light: vec4f,
    /// Mean direction weighted by luminance, shorter than 1 where the light is spread; w: half the width of that spread.
    centroid: vec4f,
}

@group(0) @binding(2) var source: texture_cube<f32>;
@group(0) @binding(3) var pyramid: texture_cube<f32>;
@group(0) @binding(4) var cube_sampler: sampler;
@group(0) @binding(5) var output: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(6) var<uniform> convolve: Convolve;
@group(0) @binding(7) var source_texels: texture_2d_array<f32>;
@group(0) @binding(8) var<storage, read_write> blocks: array<Block>;

/// Blocks along a cube edge.
const BLOCK_EDGE: u32 = 16u;

/// Direction (cube frame) of a position -1…1 on a face.
fn face_direction(face: u32, p: vec2f) -> vec3f {
    switch face {
        case 0u: { return normalize(vec3f(1.0, -p.y, -p.x)); }
        case 1u: { return normalize(vec3f(-1.0, -p.y, p.x)); }
        case 2u: { return normalize(vec3f(p.x, 1.0, p.y)); }
        case 3u: { return normalize(vec3f(p.x, -1.0, -p.y)); }
        case 4u: { return normalize(vec3f(p.x, -p.y, 1.0)); }
        default: { return normalize(vec3f(-p.x, -p.y, -1.0)); }
    }
}

fn face_position(texel: vec2u, edge: u32) -> vec2f {
    return (2.0 * vec2f(texel) + 1.0) / f32(edge) - 1.0;
}

/// Antiderivative of the solid angle of a rectangle on the face plane z = 1 with a corner on the axis.
fn corner_angle(p: vec2f) -> f32 {
    return atan2(p.x * p.y, sqrt(dot(p, p) + 1.0));
}

/// Solid angle of a texel in steradian.
fn solid_angle(texel: vec2u, edge: u32) -> f32 {
    let half = vec2f(1.0 / f32(edge));
    let center = face_position(texel, edge);
    let low = center - half;
    let high = center + half;
    return corner_angle(high) + corner_angle(low) - corner_angle(vec2f(low.x, high.y)) - corner_angle(vec2f(high.x, low.y));
}

/// One thread per block: its light and where that comes from.
@compute @workgroup_size(8, 8, 1)
fn gather_blocks(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= vec2u(BLOCK_EDGE)) {
        return;
    }
    let edge = textureDimensions(source_texels).x;
    let step = max(edge / BLOCK_EDGE, 1u);
    var light = vec3f(0.0);
    var moment = vec3f(0.0);
    var plain = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < step * step; i++) {
        let texel = min(id.xy * step + vec2u(i % step, i / step), vec2u(edge - 1u));
        let radiance = textureLoad(source_texels, texel, id.z, 0).rgb;
        let dir = face_direction(id.z, face_position(texel, edge));
        let angle = solid_angle(texel, edge);
        let luminance = dot(radiance, vec3f(0.2126, 0.7152, 0.0722)) * angle;
        light += radiance * angle;
        moment += dir * luminance;
        plain += dir * angle;
        weight_sum += luminance;
    }
    let centroid = select(normalize(plain), moment / max(weight_sum, 1e-20), weight_sum > 1e-20);
    // Evenly spread over ±w along each of two axes, unit vectors have a mean of squared length 1 − 2w²/3.
    let spread = sqrt(max(1.5 * (1.0 - dot(centroid, centroid)), 0.0));
    blocks[(id.z * BLOCK_EDGE + id.y) * BLOCK_EDGE + id.x] = Block(vec4f(light, 0.0), vec4f(centroid, spread));
}

/// Mean of the positive part of the cosine over a block: a block on the horizon lights with the part of it that has risen.
fn mean_cosine(normal: vec3f, block: Block) -> f32 {
    let cosine = dot(normal, block.centroid.xyz);
    let spread = block.centroid.w;
    let risen = cosine + spread;
    return select(max(cosine, 0.0), risen * risen / (4.0 * spread), abs(cosine) < spread);
}

/// Irradiance ÷ π for each direction of the output: the cosine-weighted sum of all blocks.
@compute @workgroup_size(8, 8, 1)
fn diffuse(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let normal = face_direction(id.z, face_position(id.xy, edge));
    var sum = vec3f(0.0);
    for (var i = 0u; i < 6u * BLOCK_EDGE * BLOCK_EDGE; i++) {
        sum += blocks[i].light.rgb * mean_cosine(normal, blocks[i]);
    }
    textureStore(output, id.xy, id.z, vec4f(sum / PI, 1.0));
}

/// Point i of n of the Hammersley set.
fn hammersley(i: u32, n: u32) -> vec2f {
    return vec2f((f32(i) + 0.5) / f32(n), f32(reverseBits(i)) * 2.3283064365386963e-10);
}

/// Radiance seen in a GGX surface from straight above (normal = view): importance samples of the distribution of normals,
/// each looked up where a pyramid texel covers the solid angle the sample stands for (Křivánek & Colbert 2008).
@compute @workgroup_size(8, 8, 1)
fn glossy(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(output).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let normal = face_direction(id.z, face_position(id.xy, edge));
    if convolve.roughness == 0.0 {
        textureStore(output, id.xy, id.z, vec4f(textureSampleLevel(source, cube_sampler, normal, 0.0).rgb, 1.0));
        return;
    }
    let alpha = convolve.roughness * convolve.roughness;
    let tangent = normalize(cross(normal, select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(normal.y) < 0.7)));
    let bitangent = cross(normal, tangent);
    let texel_angle = 4.0 * PI / (6.0 * convolve.source_edge * convolve.source_edge);
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < convolve.samples; i++) {
        let u = hammersley(i, convolve.samples);
        let cos_half_squared = (1.0 - u.x) / (1.0 + (alpha * alpha - 1.0) * u.x);
        let cos_half = sqrt(cos_half_squared);
        let sin_half = sqrt(max(1.0 - cos_half_squared, 0.0));
        let azimuth = 2.0 * PI * u.y;
        let local = 2.0 * cos_half * vec3f(sin_half * cos(azimuth), sin_half * sin(azimuth), cos_half) - vec3f(0.0, 0.0, 1.0);
        if local.z <= 0.0 {
            continue;
        }
        let d = cos_half_squared * (alpha * alpha - 1.0) + 1.0;
        let density = alpha * alpha / (PI * d * d) / 4.0;
        let sample_angle = 1.0 / (f32(convolve.samples) * density);
        let dir = tangent * local.x + bitangent * local.y + normal * local.z;
        // The pyramid starts one level below the source; half a level more smooths the transition between samples.
        let level = clamp(0.5 * log2(sample_angle / texel_angle) - 0.5, 0.0, convolve.coarsest_level);
        sum += textureSampleLevel(pyramid, cube_sampler, dir, level).rgb * local.z;
        weight_sum += local.z;
    }
    textureStore(output, id.xy, id.z, vec4f(sum / weight_sum, 1.0));
}
