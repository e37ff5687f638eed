// Deconvolution of a lookup: makes up for the blur of two bilinear filters, frame → cube and cube → mirror.

#define_import_path bevy_mirrorball::unwrap::deconvolution

#import bevy_mirrorball::unwrap::bindings::unwrap
#import bevy_mirrorball::unwrap::frame_sampling::frame_pixel

/// Fraction of a pixel that leaks to the neighbor on one side, per pixel of standard deviation of the blur: half the
/// mean absolute value of a normal deviate.
const LEAK: f32 = 0.4;
/// Upper limit of the leak. A leak of 0.5 could not be undone at all; that of a texel as large as a pixel is 0.17.
const MAX_LEAK: f32 = 0.25;
/// Texel sizes in pixels between which the correction fades out. Two texels per pixel can follow single pixels; one
/// texel per pixel cannot, and would only get harder edges than the room has.
const COARSE: vec2f = vec2f(0.5, 1.0);

/// Excess of a pixel over its neighbors, times a fraction for the horizontal and one for the vertical neighbors. It
/// is 0 for a clipped pixel, whose true value is unknown.
fn excess(value: vec3f, beside: vec3f, above_and_below: vec3f, fraction: vec2f) -> vec3f {
    let more = fraction.x * (2.0 * value - beside) + fraction.y * (2.0 * value - above_and_below);
    return select(more, vec3f(0.0), any(value >= vec3f(unwrap.clipped_from)));
}

/// Correction of a lookup, after which the cube, interpolated linearly between its texels, returns the pixels of the
/// frame.
///
/// One step of Van Cittert's deconvolution (1931): the interpolation between pixels and the one between texels spread
/// each pixel over its neighbors by a known fraction, which is taken back from them. Beside a lamp, that is light of
/// the lamp, which counts as white already.
fn leaked(pixel: vec2f, texel: mat2x2f, sharpness: f32) -> vec3f {
    // Variances of a box as wide as the ramp between pixels and of a triangle two texels wide, along the frame's axes.
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
        excess(
            top_left,
            frame_pixel(p - vec2i(1, 0)) + top_right,
            frame_pixel(p - vec2i(0, 1)) + bottom_left,
            fraction,
        ),
        excess(
            top_right,
            top_left + frame_pixel(p + vec2i(2, 0)),
            frame_pixel(p + vec2i(1, -1)) + bottom_right,
            fraction,
        ),
        t.x,
    );
    let bottom = mix(
        excess(
            bottom_left,
            frame_pixel(p + vec2i(-1, 1)) + bottom_right,
            top_left + frame_pixel(p + vec2i(0, 2)),
            fraction,
        ),
        excess(
            bottom_right,
            bottom_left + frame_pixel(p + vec2i(2, 1)),
            top_right + frame_pixel(p + vec2i(1, 2)),
            fraction,
        ),
        t.x,
    );
    return mix(top, bottom, t.y);
}
