// Lookups in a frame: interpolated between pixels, with clipped channels recovered, and averaged over a texel.
//
// EQUIRECT: columns wrap around.

#define_import_path bevy_mirrorball::unwrap::frame_sampling

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::unwrap::bindings::{frame, unwrap}

/// Maximum number of lookups per texel along each axis; below it, one lookup per pixel that the texel covers.
const MAX_SAMPLES: f32 = 4.0;
/// Sharpness of lookups: slope of the ramp between two pixels, where 1 is linear interpolation. At 3, a pixel leaks 4
/// % to each neighbor instead of 12.5 %.
const SHARP: f32 = 3.0;
/// Linear interpolation, for the rim of a ball: a pixel there spans so many degrees that its center counts more than
/// its mean.
const SMOOTH: f32 = 1.0;
/// Width in pixels over which visibility falls off, at the frame's border and beside what hides the ball.
const SOFT_PIXELS: f32 = 4.0;

/// Pixel as the camera delivered it.
fn frame_pixel(pixel: vec2i) -> vec3f {
    let size = vec2i(textureDimensions(frame));
#ifdef EQUIRECT
    let column = ((pixel.x % size.x) + size.x) % size.x;
    return textureLoad(frame, vec2i(column, clamp(pixel.y, 0, size.y - 1)), 0).rgb;
#else
    return textureLoad(frame, clamp(pixel, vec2i(0), size - 1), 0).rgb;
#endif
}

/// Pixel with its clipped channels multiplied by a gain, up to the limit that its other channels make likely. Twin of
/// `gain_limits` in `clipping.rs`.
fn recovered(pixel: vec2i, gain: vec3f) -> vec3f {
    let value = frame_pixel(pixel);
    let is_clipped = value >= vec3f(unwrap.clipped_from);
    if !any(is_clipped) {
        return value;
    }
    if luminance(value) >= unwrap.white_from {
        return value * gain;
    }
    let unclipped = select(value, vec3f(0.0), is_clipped);
    let limit = unwrap.max_saturation * max(unclipped.r, max(unclipped.g, unclipped.b));
    return select(value, clamp(value * gain, value, max(vec3f(limit), value)), is_clipped);
}

/// Interpolation between four pixels. The gain is applied to each pixel before they are mixed.
fn sample_frame(pixel: vec2f, gain: vec3f, sharpness: f32) -> vec3f {
    let corner = floor(pixel - 0.5);
    let t = clamp((pixel - 1.0 - corner) * sharpness + 0.5, vec2f(0.0), vec2f(1.0));
    let p = vec2i(corner);
    let top = mix(recovered(p, gain), recovered(p + vec2i(1, 0), gain), t.x);
    let bottom = mix(recovered(p + vec2i(0, 1), gain), recovered(p + vec2i(1, 1), gain), t.x);
    return mix(top, bottom, t.y);
}

/// Mean over the parallelogram that a texel covers around a pixel position.
fn mean_of_frame(pixel: vec2f, texel: mat2x2f, gain: vec3f, sharpness: f32) -> vec3f {
    let count = clamp(ceil(vec2f(length(texel[0]), length(texel[1]))), vec2f(1.0), vec2f(MAX_SAMPLES));
    let columns = u32(count.x);
    let samples = columns * u32(count.y);
    var sum = vec3f(0.0);
    var i = 0u;
    // Bottom-tested loop: software Vulkan executes one extra iteration of a top-tested loop, which would mostly double
    // the cost here.
    loop {
        let offset = (vec2f(vec2u(i % columns, i / columns)) + 0.5) / count - 0.5;
        sum += sample_frame(pixel + texel * offset, gain, sharpness);
        continuing {
            i++;
            break if i >= samples;
        }
    }
    return sum / (count.x * count.y);
}

/// Visibility by distance from the frame's border: 1 inside, falling to 0 at the border.
fn inside_frame(pixel: vec2f) -> f32 {
    let inset = min(pixel, vec2f(textureDimensions(frame)) - pixel);
    return clamp(min(inset.x, inset.y) / SOFT_PIXELS, 0.0, 1.0);
}
