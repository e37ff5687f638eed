// StandardMaterial in flat bands: the light that a white matte surface would receive, quantized between the darkest
// and the brightest light in the room. The formulas are in the documentation of materials/mod.rs.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_view_bindings::view,
    pbr_types::{PbrInput, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
}
#import bevy_mirrorball::materials::engine_features::{output_of, surface_of}
#import bevy_mirrorball::materials::toon::room_light::room_light
#import bevy_mirrorball::luminance::luminance

/// Mirror of `ToonUniform` in `toon_material.rs`.
struct Toon {
    /// Number of bands, 2 to 5.
    bands: f32,
    /// 1 with a highlight, 0 without.
    highlight: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(105) var<uniform> toon: Toon;

/// Smallest range between dark and bright light, as a fraction of the brightest, so that shadows are visible under a
/// uniform sky too.
const MIN_RANGE: f32 = 0.3;
/// Largest brightness of the dark color, as a fraction of the brightest light, so that bands stay distinguishable in
/// any room.
const MAX_DARK: f32 = 0.45;
/// Largest half width of a band edge, as a fraction of a band: software Vulkan computes wrong derivatives of light
/// where triangles meet.
const MAX_EDGE_HALF_WIDTH: f32 = 0.2;
/// Smallest perceptual roughness that sets the size of a highlight; at this value it is 15° across on a ball.
const MIN_HIGHLIGHT_ROUGHNESS: f32 = 0.55;
/// Perceptual roughness up to which highlights are opaque (x), and from which there are none (y).
const HIGHLIGHT_ROUGHNESS: vec2f = vec2f(0.25, 0.75);
/// Range of light, as a fraction of the brightest, from which on the highlight has its full strength: the direction
/// of the light is well defined.
const DIRECTIONAL_RANGE: f32 = 0.2;
/// Smallest difference of light that counts, in frame buffer units; also keeps divisors above zero.
const MIN_LIGHT: f32 = 1e-6;

/// Band number, from 0, at a position 0…1 between dark and bright. Band edges are one pixel wide.
fn band_at(position: f32) -> f32 {
    let scaled = position * toon.bands;
    let half_width = clamp(0.5 * fwidth(scaled), MIN_LIGHT, MAX_EDGE_HALF_WIDTH);
    var band = 0.0;
    for (var edge = 1.0; edge < toon.bands; edge += 1.0) {
        band += smoothstep(edge - half_width, edge + half_width, scaled);
    }
    return band;
}

/// Level of a band, 0…1. The highest band has level 1, the lowest the middle of its range, so that no shape becomes
/// black.
fn band_level(band: f32) -> f32 {
    return mix(0.5 / toon.bands, 1.0, band / (toon.bands - 1.0));
}

/// Opacity of the highlight: a disc with a hard edge around the point where a perfect mirror would show the
/// prevailing light.
fn highlight(surface: PbrInput, dir_bright: vec3f) -> f32 {
    let roughness = surface.material.perceptual_roughness;
    let rough = max(roughness, MIN_HIGHLIGHT_ROUGHNESS);
    let alpha = rough * rough;
    let towards_light = max(dot(reflect(-surface.V, surface.N), dir_bright), MIN_LIGHT);
    let lobe = pow(towards_light, 2.0 / (alpha * alpha) - 2.0);
    let half_width = clamp(0.5 * fwidth(lobe), MIN_LIGHT, MAX_EDGE_HALF_WIDTH);
    let gloss = 1.0 - smoothstep(HIGHLIGHT_ROUGHNESS.x, HIGHLIGHT_ROUGHNESS.y, roughness);
    return gloss * smoothstep(0.5 - half_width, 0.5 + half_width, lobe);
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    let pbr_input = surface_of(in, is_front);
    let base_color = pbr_input.material.base_color;
    let emissive = pbr_input.material.emissive;

    let light = room_light(in, pbr_input);
    let dir_bright = light.dir_bright;
    let bright = light.bright;
    let opposite = light.opposite;
    let arriving = luminance(light.arriving);
    let brightest = luminance(bright);
    let darkest = luminance(opposite);
    let range = max(brightest - darkest, max(MIN_RANGE * brightest, MIN_LIGHT));
    let band = band_at((arriving - brightest) / range + 1.0);
    let dark = opposite * min(1.0, MAX_DARK * brightest / max(darkest, MIN_LIGHT));
    let matte = base_color.rgb * mix(dark, bright, band_level(band));
    let has_direction = saturate((brightest - darkest) / max(DIRECTIONAL_RANGE * brightest, MIN_LIGHT));
    let gloss = highlight(pbr_input, dir_bright) * toon.highlight * has_direction * saturate(band);

    let glow = emissive.rgb * base_color.a * mix(1.0, view.exposure, emissive.a);
    let lit = vec4f(mix(matte, bright, gloss) + glow, base_color.a);
    let is_unlit = (pbr_input.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) != 0u;
    return output_of(pbr_input, select(lit, base_color, is_unlit));
}
