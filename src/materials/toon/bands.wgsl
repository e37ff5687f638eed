// Steps of brightness: the bands of a style, or ramps.
//
// Definitions: DIFFUSE_RAMP, SPECULAR_RAMP: a ramp stands in for the bands, for the edge of the highlight.

#define_import_path bevy_mirrorball::materials::toon::bands

#import bevy_mirrorball::materials::toon::toon_bindings::{ramps, toon}

/// Largest half width of an edge that is smoothed over a pixel, as a fraction of a band: software Vulkan computes wrong
/// derivatives of light where triangles meet.
const MAX_EDGE_HALF_WIDTH: f32 = 0.2;
const MIN_EDGE_HALF_WIDTH: f32 = 1e-6;

/// Half a pixel's change of a number whose edges are smoothed.
fn half_pixel(number: f32) -> f32 {
    return clamp(0.5 * fwidth(number), MIN_EDGE_HALF_WIDTH, MAX_EDGE_HALF_WIDTH);
}

/// Edge at a number, one pixel wide, 0 below and 1 above.
fn edge(at: f32, number: f32) -> f32 {
    let half_width = half_pixel(number);
    return smoothstep(at - half_width, at + half_width, number);
}

/// A step of brightness.
struct Step {
    /// 0…1 between the dark and the bright color, per channel.
    level: vec3f,
    /// 0 in the darkest step, 1 above.
    above_lowest: f32,
}

#ifdef DIFFUSE_RAMP
fn diffuse_step_at(place: f32) -> vec3f {
    return ramps.diffuse[u32(clamp(place, 0.0, ramps.diffuse_steps - 1.0))].rgb;
}

/// Step of the ramp at a position 0…1 between dark and bright. The darkest color counts as level 0.
fn diffuse_step(position: f32, darkest: f32) -> Step {
    let place = position * ramps.diffuse_steps;
    let half_width = half_pixel(place);
    let level = 0.5 * (diffuse_step_at(place - half_width) + diffuse_step_at(place + half_width));
    return Step(level, smoothstep(1.0 - half_width, 1.0 + half_width, place));
}
#else
/// Band at a position 0…1 between dark and bright: bands are equally wide, and equally spaced in lightness (the cube
/// root of luminance). `darkest` is the luminance of the dark color as a fraction of that of the bright one. The lowest
/// band has the middle of its range, so that no shape becomes black.
fn diffuse_step(position: f32, darkest: f32) -> Step {
    let place = position * toon.bands;
    let half_width = max(half_pixel(place), toon.edge_half_width);
    var band = 0.0;
    for (var above = 1.0; above < toon.bands; above += 1.0) {
        band += smoothstep(above - half_width, above + half_width, place);
    }
    let lowest = mix(darkest, 1.0, 0.5 / toon.bands);
    let lightness = mix(pow(lowest, 1.0 / 3.0), 1.0, band / (toon.bands - 1.0));
    let level = (lightness * lightness * lightness - darkest) / max(1.0 - darkest, MIN_EDGE_HALF_WIDTH);
    return Step(vec3f(level), saturate(band));
}
#endif

#ifdef SPECULAR_RAMP
fn specular_step_at(place: f32) -> vec3f {
    return ramps.specular[u32(clamp(place, 0.0, ramps.specular_steps - 1.0))].rgb;
}

/// Step of the highlight at a height 0…1 of its lobe.
fn specular_step(lobe: f32) -> vec3f {
    let place = lobe * ramps.specular_steps;
    let half_width = half_pixel(place);
    return 0.5 * (specular_step_at(place - half_width) + specular_step_at(place + half_width));
}
#else
/// Step of the highlight at a height 0…1 of its lobe: one, at the half.
fn specular_step(lobe: f32) -> vec3f {
    return vec3f(edge(0.5, lobe));
}
#endif
