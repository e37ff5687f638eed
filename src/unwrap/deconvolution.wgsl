// Deconvolution of a lookup, which makes up for the blur of two bilinear filters: frame → cube → mirror.

#define_import_path bevy_mirrorball::unwrap::deconvolution

#import bevy_mirrorball::unwrap::bindings::unwrap
#import bevy_mirrorball::unwrap::frame_sampling::frame_pixel

/// Share of a pixel that gets to the neighbor on one side, per standard deviation of what spreads it, in pixels: half the mean size of
/// a normal deviate.
const LEAK: f32 = 0.4;
/// A leak of half a pixel could not be made up for at all; that of a texel as large as a pixel is 0.17.
const MAX_LEAK: f32 = 0.25;
/// Texel sizes in pixels from which on less and nothing is made up for: two texels per pixel can follow single pixels, one
/// cannot and would only get harder edges than the room has.
const COARSE: vec2f = vec2f(0.5, 1.0);

/// What a pixel has more than its neighbors, times a share for those beside and those above and below. A clipped one keeps what
/// it has: how much more it should get, nobody knows.
fn excess(value: vec3f, beside: vec3f, above_and_below: vec3f, fraction: vec2f) -> vec3f {
    let more = fraction.x * (2.0 * value - beside) + fraction.y * (2.0 * value - above_and_below);
    return select(more, vec3f(0.0), any(value >= vec3f(unwrap.clipped_from)));
}

/// What a lookup lacks so that the cube, read linearly between its texels, gives back the pixels of the picture. A step of Van Cittert's
/// deconvolution (1931): the passage between pixels and that between texels spread each pixel over its neighbors by a known
/// share, which is taken back from them. Beside a lamp that is light of the lamp, which counts as white already.
fn leaked(pixel: vec2f, texel: mat2x2f, sharpness: f32) -> vec3f {
    // Variances of a box as wide as the passage and of a triangle two texels wide, along the picture's axes.
    let spread = 1.0 / (12.0 * sharpness * sharpness) + (texel[0] * texel[0] + texel[1] * texel[1]) / 6.0;
    let leak = min(LEAK * sqrt(spread), vec2f(MAX_LEAK));
    let is_fine = clamp((COARSE.y - sqrt(abs(determinant(texel)))) / (COARSE.y - COARSE.x), 0.0, 1.0);
    let fraction = is_fine * leak / (1.0 - 2.0 * leak);
    let corner = floor(pixel - 0.5);
    let t = clamp((pixel - 1.0 - corner) * sharpness + 0.5, vec2f(0.0), vec2f(1.0));
    let p = vec2i(corner);
    let top_left = frame_pixel(p);
    let top_right = frame_pixel(p + vec2i(1, 0));
    let bottom_left = frame_pixel(p + vec2i(0, 1));
    let bottom_right = frame_pixel(p + vec2i(1, 1));
    let top = mix(
        excess(top_left, frame_pixel(p - vec2i(1, 0)) + top_right, frame_pixel(p - vec2i(0, 1)) + bottom_left, fraction),
        excess(top_right, top_left + frame_pixel(p + vec2i(2, 0)), frame_pixel(p + vec2i(1, -1)) + bottom_right, fraction),
        t.x,
    );
    let bottom = mix(
        excess(bottom_left, frame_pixel(p + vec2i(-1, 1)) + bottom_right, top_left + frame_pixel(p + vec2i(0, 2)), fraction),
        excess(bottom_right, bottom_left + frame_pixel(p + vec2i(2, 1)), top_right + frame_pixel(p + vec2i(1, 2)), fraction),
        t.x,
    );
    return mix(top, bottom, t.y);
}
