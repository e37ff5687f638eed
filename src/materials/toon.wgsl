// StandardMaterial in flat bands: the light that a white matte surface would get, in steps between the room's darkest
// and brightest light. The formulas are in mod.rs.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings::view,
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::{alpha_discard, apply_pbr_lighting, main_pass_post_lighting_processing},
    pbr_types::{PbrInput, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
}
#import bevy_mirrorball::shadows::receive::virtual_ratio

/// Mirror of `ToonUniform` in toon.rs.
struct Toon {
    bands: f32,
    /// 1 with, 0 without.
    highlight: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(105) var<uniform> toon: Toon;

/// Perceptual roughness at which the engine's diffuse term, looked at along the normal, is Lambert's to 3 %.
const LAMBERT_ROUGHNESS: f32 = 0.70710678;
/// Keeps the direction of view off the exact opposite of a lamp's, where the engine's half vector has no direction.
const OFF_NORMAL: vec3f = vec3f(0.0137, 0.0071, -0.0093);
/// Light that comes from everywhere is looked at as if it varied by at least this share of the brightest, so that shadows
/// show under an even sky too.
const MIN_RANGE: f32 = 0.3;
/// The darkest band has at most this share of the brightest, so that bands are told apart in any room.
const MAX_DARK: f32 = 0.45;
/// Half an edge is at most this share of a band: software Vulkan has wrong derivatives of light where triangles meet.
const MAX_EDGE_HALF_WIDTH: f32 = 0.2;
/// Highlights are no smaller than that of this perceptual roughness, 15° across on a ball.
const MIN_HIGHLIGHT_ROUGHNESS: f32 = 0.55;
/// Perceptual roughness up to which highlights are opaque, and from which there are none.
const HIGHLIGHT_ROUGHNESS: vec2f = vec2f(0.25, 0.75);
/// Light that varies by this share of the brightest has a direction clear enough for a highlight.
const DIRECTIONAL_RANGE: f32 = 0.2;
/// Differences of light below this (frame buffer units) are none.
const MIN_LIGHT: f32 = 1e-6;

fn luminance(color: vec3f) -> f32 {
    return dot(color, vec3f(0.2126, 0.7152, 0.0722));
}

/// Light of all sources on a surface that faces a direction, as white paper would show it.
fn light_at(paper: PbrInput, normal: vec3f) -> vec3f {
    var turned = paper;
    turned.N = normal;
    turned.V = normalize(normal + OFF_NORMAL);
    return apply_pbr_lighting(turned).rgb;
}

/// Direction from which the light prevails. Whatever the lamps and the environment, irradiance at n minus irradiance at
/// −n is n · (light vector), so three pairs give the vector exactly (Gershun 1936, *The Light Field*).
fn prevailing_direction(paper: PbrInput, fallback: vec3f) -> vec3f {
    var light_vector = vec3f(0.0);
    for (var axis = 0u; axis < 3u; axis++) {
        let dir = vec3f(vec3u(axis) == vec3u(0u, 1u, 2u));
        light_vector[axis] = luminance(light_at(paper, dir)) - luminance(light_at(paper, -dir));
    }
    let strength = length(light_vector);
    return select(fallback, light_vector / max(strength, MIN_LIGHT), strength > MIN_LIGHT);
}

/// Band number, from 0, at a position 0…1 between dark and bright. Edges are one pixel wide.
fn band_at(position: f32) -> f32 {
    let scaled = position * toon.bands;
    let half_width = clamp(0.5 * fwidth(scaled), MIN_LIGHT, MAX_EDGE_HALF_WIDTH);
    var band = 0.0;
    for (var edge = 1.0; edge < toon.bands; edge += 1.0) {
        band += smoothstep(edge - half_width, edge + half_width, scaled);
    }
    return band;
}

/// Share of light of a band. The highest has all, the lowest the middle of its range, so that no form sinks into black.
fn band_level(band: f32) -> f32 {
    return mix(0.5 / toon.bands, 1.0, band / (toon.bands - 1.0));
}

/// How much of a point is highlight: 1 around where a perfect mirror would show the prevailing light, with a hard edge.
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
    var pbr_input = pbr_input_from_standard_material(in, is_front);
    let base_color = alpha_discard(pbr_input.material, pbr_input.material.base_color);
    let emissive = pbr_input.material.emissive;

    var paper = pbr_input;
    paper.material.base_color = vec4f(1.0);
    paper.material.emissive = vec4f(0.0);
    paper.material.metallic = 0.0;
    paper.material.perceptual_roughness = LAMBERT_ROUGHNESS;
    paper.material.reflectance = vec3f(0.0);
    let is_receiver = (pbr_input.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    let ratio = virtual_ratio(in.position, in.world_position.xyz, pbr_input.N);
    paper.diffuse_occlusion *= select(vec3f(1.0), ratio, is_receiver);
    let arriving = luminance(light_at(paper, pbr_input.N));

    paper.diffuse_occlusion = vec3f(1.0);
    paper.flags &= ~MESH_FLAGS_SHADOW_RECEIVER_BIT;
    let dir_bright = prevailing_direction(paper, pbr_input.N);
    let bright = light_at(paper, dir_bright);
    let opposite = light_at(paper, -dir_bright);
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
    return FragmentOutput(main_pass_post_lighting_processing(pbr_input, select(lit, base_color, is_unlit)));
}
