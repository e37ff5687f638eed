// Blurs the mask of a light with a Gaussian, along columns and then along rows, and takes the light's share of it from
// the fraction of light that is left.

#import bevy_mirrorball::environment_map::cubemap::sample_faces

/// Mirror of `BlurUniform` in `blur_pipeline.rs`.
struct Blur {
    /// Share of the light, or its irradiance at the receiver; of the rest of the light, what the others have of these.
    share: vec3f,
    /// Standard deviation along columns, in texels.
    sigma_across: f32,
    /// Normal of the receiver in the frame of the environment; 0 for a known share.
    normal: vec3f,
    /// Standard deviation along rows, in texels.
    sigma_down: f32,
    /// Fraction of the share that is taken.
    strength: f32,
    /// 1 for the rest of the light.
    is_rest: u32,
}

@group(0) @binding(0) var mask: texture_2d<f32>;
@group(0) @binding(1) var<uniform> blur: Blur;
/// Diffuse map of the environment: irradiance ÷ π.
@group(0) @binding(2) var diffuse_faces: texture_2d_array<f32>;

const PI: f32 = 3.14159265;
/// Standard deviations beyond which the Gaussian is taken for 0.
const REACH: f32 = 2.5;
const MAX_RADIUS: i32 = 48;
/// Below, neighbors have no weight that counts.
const MIN_SIGMA: f32 = 0.3;

struct Varyings {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat) share: vec3f,
}

/// One triangle over the whole texture. The share is the same everywhere.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    var out: Varyings;
    out.position = vec4f(f32(index & 1u) * 4.0 - 1.0, f32(index >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    var share = blur.share;
    var is_lit = vec3<bool>(true);
    if any(blur.normal != vec3f(0.0)) {
        // The frame of a cube is left-handed.
        let all_light = PI * sample_faces(diffuse_faces, blur.normal * vec3f(1.0, 1.0, -1.0), 0u).rgb;
        share /= max(all_light, vec3f(1e-9));
        is_lit = all_light >= vec3f(1e-6);
    }
    if blur.is_rest == 1u {
        share = 1.0 - share;
    }
    // Without any light there are no shadows either.
    out.share = blur.strength * select(vec3f(0.0), clamp(share, vec3f(0.0), vec3f(1.0)), is_lit);
    return out;
}

fn blurred(pixel: vec2i, step: vec2i, sigma: f32) -> vec3f {
    let middle = textureLoad(mask, pixel, 0).rgb;
    if sigma < MIN_SIGMA {
        return middle;
    }
    let last = vec2i(textureDimensions(mask)) - 1;
    let radius = min(i32(ceil(REACH * sigma)), MAX_RADIUS);
    var sum = middle;
    var weights = 1.0;
    for (var i = 1; i <= radius; i++) {
        let off = f32(i) / sigma;
        let weight = exp(-0.5 * off * off);
        sum += weight * textureLoad(mask, clamp(pixel + i * step, vec2i(0), last), 0).rgb;
        sum += weight * textureLoad(mask, clamp(pixel - i * step, vec2i(0), last), 0).rgb;
        weights += 2.0 * weight;
    }
    return sum / weights;
}

@fragment
fn blur_across(in: Varyings) -> @location(0) vec4f {
    return vec4f(blurred(vec2i(in.position.xy), vec2i(1, 0), blur.sigma_across), 0.0);
}

/// Its result is subtracted.
@fragment
fn take_share(in: Varyings) -> @location(0) vec4f {
    return vec4f(in.share * blurred(vec2i(in.position.xy), vec2i(0, 1), blur.sigma_down), 0.0);
}
