// Blurs virtual things by what their edges lack beside those of the frame, lays them over the frame again and adds the
// noise of the frame to them. Alpha of the rendered view is the fraction of a pixel that is virtual.

/// Mirror of `GrainUniform` in `grain_pipeline.rs`.
struct Grain {
    /// By pixel of the viewport: frame_px = view_px * xy + zw
    frame_px_from_view_px: vec4f,
    /// Place and size of the viewport in pixels.
    viewport: vec4i,
    /// Place in the tile of noise, by octave.
    offsets: array<vec4u, 3>,
    /// By octave and brightness: standard deviations of red, green and blue, relative to white and sRGB-encoded, and
    /// the square root of the fraction of their variances that they share.
    levels: array<vec4f, 48>,
    /// Weights of the blur by distance along an axis.
    weights: array<vec4f, 3>,
}

@group(0) @binding(0) var rendered: texture_2d<f32>;
@group(0) @binding(1) var noise: texture_2d_array<f32>;
@group(0) @binding(2) var<uniform> grain: Grain;

const RADIUS: i32 = #{RADIUS};
/// Twin of `TILE` in `noise_tile.rs`.
const TILE: i32 = 256;
/// Twin of `RANGE` in `noise_tile.rs`.
const RANGE: f32 = 4.0;
/// Twin of `BINS` in `noise_bands.rs`.
const BINS: i32 = 16;
const OCTAVES: i32 = 3;
/// Twin of `LUMA_WEIGHTS` in `noise_bands.rs`.
const LUMA_WEIGHTS: vec3f = vec3f(0.299, 0.587, 0.114);
/// Alpha below which a pixel is real.
const MIN_VIRTUAL: f32 = 0.002;

fn weight(offset: i32) -> f32 {
    let distance = abs(offset);
    return grain.weights[distance / 4][distance % 4];
}

fn encoded(linear: vec3f) -> vec3f {
    let c = clamp(linear, vec3f(0.0), vec3f(1.0));
    return select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308));
}

fn decoded(srgb: vec3f) -> vec3f {
    let c = clamp(srgb, vec3f(0.0), vec3f(1.0));
    return select(pow((c + 0.055) / 1.055, vec3f(2.4)), c / 12.92, c <= vec3f(0.04045));
}

/// Noise at a pixel of the frame, in standard deviations: of red, green and blue alone, and shared.
fn noise_texel(pixel: vec2i, octave: i32) -> vec4f {
    // Outside of the frame too: the tile repeats.
    let place = (pixel + vec2i(grain.offsets[octave].xy)) & vec2i(TILE - 1);
    return textureLoad(noise, place, octave, 0) * RANGE;
}

/// Noise between pixels of the frame, filtered as the frame is.
fn noise_at(pos_frame: vec2f, octave: i32) -> vec4f {
    let first = floor(pos_frame - 0.5);
    let along = pos_frame - 0.5 - first;
    let pixel = vec2i(first);
    let upper = mix(noise_texel(pixel, octave), noise_texel(pixel + vec2i(1, 0), octave), along.x);
    let lower = mix(noise_texel(pixel + vec2i(0, 1), octave), noise_texel(pixel + vec2i(1, 1), octave), along.x);
    return mix(upper, lower, along.y);
}

/// Noise of the frame at a place in it where it has a color, sRGB-encoded as that is.
fn frame_noise(pos_frame: vec2f, color: vec3f) -> vec3f {
    let brightness = clamp(dot(color, LUMA_WEIGHTS) * f32(BINS) - 0.5, 0.0, f32(BINS - 1));
    let bin = min(i32(brightness), BINS - 2);
    var sum = vec3f(0.0);
    for (var octave = 0; octave < OCTAVES; octave++) {
        let first = octave * BINS + bin;
        let level = mix(grain.levels[first], grain.levels[first + 1], brightness - f32(bin));
        let values = noise_at(pos_frame, octave);
        sum += level.rgb * (level.a * values.a + sqrt(max(1.0 - level.a * level.a, 0.0)) * values.rgb);
    }
    return sum;
}

@fragment
fn add_grain(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(position.xy);
    let here = textureLoad(rendered, pixel, 0);
    let first = grain.viewport.xy;
    let last = first + grain.viewport.zw - 1;
    if any(pixel < first) || any(pixel > last) {
        return here;
    }
    var all = vec3f(0.0);
    var real = vec4f(0.0);
    var covered = 0.0;
    for (var y = -RADIUS; y <= RADIUS; y++) {
        for (var x = -RADIUS; x <= RADIUS; x++) {
            let there = textureLoad(rendered, clamp(pixel + vec2i(x, y), first, last), 0);
            let w = weight(x) * weight(y);
            all += w * there.rgb;
            real += select(0.0, w, there.a < MIN_VIRTUAL) * vec4f(there.rgb, 1.0);
            covered += w * clamp(there.a, 0.0, 1.0);
        }
    }
    if covered < MIN_VIRTUAL {
        return vec4f(here.rgb, 1.0);
    }
    // Pixels on edges are mixed with something real that nobody knows; it is taken for the mean of what is beside.
    let is_real = here.a < MIN_VIRTUAL;
    let beside = real.rgb / max(real.a, 1e-6);
    let blurred = all - real.rgb - max(1.0 - covered - real.a, 0.0) * beside;
    let rest = max(1.0 - covered, 0.0);
    let behind = select(beside, here.rgb, is_real);
    let color = max(blurred + rest * behind, vec3f(0.0));
    // What is real has its noise already; what was blurred has little of it.
    let kept = select(weight(0) * weight(0), 1.0, is_real) * rest;
    let pos_view = position.xy - vec2f(first);
    let pos_frame = pos_view * grain.frame_px_from_view_px.xy + grain.frame_px_from_view_px.zw;
    let clean = encoded(color);
    let noisy = clean + sqrt(max(1.0 - kept * kept, 0.0)) * frame_noise(pos_frame, clean);
    return vec4f(color + decoded(noisy) - decoded(clean), 1.0);
}
