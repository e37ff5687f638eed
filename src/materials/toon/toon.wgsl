// StandardMaterial in flat bands of light. The formulas are in the documentation of materials/mod.rs.
//
// Definitions: PHONG: Kunze's formula in place of the light of the room. RIM: there is a rim light.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_view_bindings::view,
    pbr_types::{PbrInput, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
}
#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::materials::engine_features::{output_of, surface_of}
#import bevy_mirrorball::materials::toon::bands::{diffuse_step, edge, specular_step}
#import bevy_mirrorball::materials::toon::room_light::{
    RoomLight, key_light_left, light_on_sides, room_light, shadowed_cosine,
}
#import bevy_mirrorball::materials::toon::toon_bindings::toon

/// Smallest range between dark and bright light, as a fraction of the brightest, so that shadows are visible under a
/// uniform sky too.
const MIN_RANGE: f32 = 0.3;
/// Smallest perceptual roughness that sets the size of a highlight; at this value it is 15° across on a ball.
const MIN_HIGHLIGHT_ROUGHNESS: f32 = 0.55;
/// Perceptual roughness up to which highlights are opaque (x), and from which there are none (y).
const HIGHLIGHT_ROUGHNESS: vec2f = vec2f(0.25, 0.75);
/// Range of light, as a fraction of the brightest, from which on the highlight has its full strength: the direction
/// of the light is well defined.
const DIRECTIONAL_RANGE: f32 = 0.2;
/// Brightness of the bands of metals, which have most of their light in the highlight, and how much white is in the
/// color of that.
const METAL_MATTE: f32 = 0.6;
const METAL_WHITE: f32 = 0.3;
/// 1 − N·V from which on a surface belongs to its rim.
const RIM_START: f32 = 0.7;
/// Smallest difference of light that counts, in frame buffer units; also keeps divisors above zero.
const MIN_LIGHT: f32 = 1e-6;

/// Height 0…1 of a highlight's lobe around the direction in which a mirror would show the key light.
fn lobe(surface: PbrInput, dir_light: vec3f, exponent: f32) -> f32 {
    return pow(max(dot(reflect(-surface.V, surface.N), dir_light), MIN_LIGHT), exponent);
}

#ifdef PHONG
/// Ramps over N·L and (R·V)ⁿ of the key light (Kunze 2006).
fn shade(surface: PbrInput, light: RoomLight) -> vec3f {
    let cosine = shadowed_cosine(light);
    let diffuse = surface.material.base_color.rgb * diffuse_step(cosine, 0.0).level;
    let specular = specular_step(lobe(surface, light.dir_bright, toon.exponent));
    return toon.diffuse * diffuse + toon.specular * toon.highlight * select(vec3f(0.0), specular, cosine > 0.0);
}
#else
/// Steps between the darkest and the brightest light of the room.
fn shade(surface: PbrInput, light: RoomLight) -> vec3f {
    let base = surface.material.base_color.rgb;
    let roughness = surface.material.perceptual_roughness;
    let brightest = luminance(light.bright);
    let darkest = luminance(light.opposite);
    let range = max(brightest - darkest, max(MIN_RANGE * brightest, MIN_LIGHT));
    let by_arrival = (luminance(light.arriving) - brightest) / range + 1.0;
    let by_key = light.chosen_cosine * key_light_left(light, light.chosen_cosine);
    let position = mix(saturate(by_arrival), by_key, light.key_weight);

    let dark = light.opposite * min(1.0, toon.max_dark * brightest / max(darkest, MIN_LIGHT));
    let tone = diffuse_step(position, luminance(dark) / max(brightest, MIN_LIGHT));
    let matte = base * mix(dark, light.bright, tone.level);

    let gloss = toon.highlight * (1.0 - smoothstep(HIGHLIGHT_ROUGHNESS.x, HIGHLIGHT_ROUGHNESS.y, roughness));
    let alpha = max(roughness, MIN_HIGHLIGHT_ROUGHNESS) * max(roughness, MIN_HIGHLIGHT_ROUGHNESS);
    let spot = specular_step(lobe(surface, light.dir_bright, 2.0 / (alpha * alpha) - 2.0));
    let has_direction = saturate((brightest - darkest) / max(DIRECTIONAL_RANGE * brightest, MIN_LIGHT));
    let opacity = spot * (gloss * max(has_direction, light.key_weight) * tone.above_lowest);
    let metallic = surface.material.metallic;
    let tint = mix(vec3f(1.0), mix(base, vec3f(1.0), METAL_WHITE), metallic);
    return mix(matte * mix(1.0, METAL_MATTE, metallic * gloss), light.bright * tint, opacity);
}
#endif

#ifdef RIM
/// Light from behind a surface, on a stripe along its silhouette.
fn rim_light(in: VertexOutput, surface: PbrInput) -> vec3f {
    let stripe = edge(RIM_START, 1.0 - saturate(dot(surface.N, surface.V)));
    let away = surface.N - surface.V;
    let dir_behind = away * inverseSqrt(max(dot(away, away), MIN_LIGHT));
    return light_on_sides(in, dir_behind)[0] * (stripe * toon.rim);
}
#else
fn rim_light(in: VertexOutput, surface: PbrInput) -> vec3f {
    return vec3f(0.0);
}
#endif

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    let surface = surface_of(in, is_front);
    let base_color = surface.material.base_color;
    let emissive = surface.material.emissive;
    let glow = emissive.rgb * base_color.a * mix(1.0, view.exposure, emissive.a);
    let lit = shade(surface, room_light(in, surface)) + rim_light(in, surface) + glow;
    let is_unlit = (surface.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) != 0u;
    return output_of(in, surface, select(vec4f(lit, base_color.a), base_color, is_unlit));
}
