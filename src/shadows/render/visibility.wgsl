// Fraction of the environment's light that arrives at a point, per color channel. The formulas are in shadows/mod.rs.
//
// Definitions: those of maps.wgsl, and KEY_LIGHTS: the dome may have key lights.

#define_import_path bevy_mirrorball::shadows::render::visibility

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::{dome, results}
#import bevy_mirrorball::shadows::render::dome::{unpack_light, unpack_solid_angle}
#import bevy_mirrorball::shadows::render::maps::{
    PHANTOM_CASTERS, TilePoint, VIRTUAL_CASTERS, above_surface, axes_of, has_casters, key_is_blocked,
    key_visibility, light_at, tile_point, visibility,
}

/// Number of the bit of `scene_flags` for lamps of the engine. The bits below are for the kinds of casters.
const LAMPS: u32 = 2u;
/// Minimum light past phantoms, as a fraction of that of the open sky. Where less is left, the frame stays unchanged.
const MIN_LIGHT_FRACTION: f32 = 1e-4;
/// Minimum visibility that counts as full, to hide the rounding of the hardware's filter.
const MIN_FULL_VISIBILITY: f32 = 0.999;

/// Number of directions that are bright enough for a shadow-map lookup. They have the first ranks.
fn bright_directions() -> u32 {
    return min(results.weights[dome.direction_count].ranked, dome.shadow_map_count);
}

/// Direction at a rank. Directions without shadow maps follow those with shadow maps.
fn direction_at(rank: u32) -> u32 {
    if rank < dome.shadow_map_count {
        return results.weights[rank].ranked;
    }
    return rank;
}

/// Whether virtual casters block a part of the light at a phantom.
fn is_in_virtual_shadow(pos_world: vec3f, normal: vec3f) -> bool {
    if !has_casters(VIRTUAL_CASTERS) {
        return false;
    }
    let bright = bright_directions();
    for (var rank = 0u; rank < bright; rank++) {
        let index = direction_at(rank);
        if is_key(index) {
            continue;
        }
        let incoming = incoming_light(index, pos_world, normal);
        let point = incoming.point;
        if incoming.cos_angle > 0.0 && visibility(VIRTUAL_CASTERS, point, point.pos, normal) < MIN_FULL_VISIBILITY {
            return true;
        }
    }
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_light(key, pos_world, normal);
        if incoming.cos_angle > 0.0 && key_is_blocked(incoming.point, normal) {
            return true;
        }
    }
#endif
    return false;
}

/// Sums of light over directions at a surface.
struct LightSums {
    /// Light without virtual casters (at a phantom) or without any casters (at a virtual surface).
    unshadowed: vec3f,
    /// Light with all casters.
    shadowed: vec3f,
    /// Luminance of all light under an open sky; only at a phantom.
    open_sky: f32,
}

fn add_sums(a: LightSums, b: LightSums) -> LightSums {
    return LightSums(a.unshadowed + b.unshadowed, a.shadowed + b.shadowed, a.open_sky + b.open_sky);
}

/// Subset of the directions to sum over: every `step`th rank, starting from `first`. Key lights are summed separately.
struct RankSubset {
    first: u32,
    step: u32,
}

const ALL_RANKS: RankSubset = RankSubset(0u, 1u);

fn is_key(index: u32) -> bool {
#ifdef KEY_LIGHTS
    return index >= dome.first_key && index < dome.shadow_map_count;
#else
    return false;
#endif
}

/// Light of one direction at a surface.
struct IncomingLight {
    point: TilePoint,
    /// Radiance × solid angle, scaled with the distance if the light is near.
    irradiance: vec3f,
    cos_angle: f32,
}

fn incoming_light(index: u32, pos_world: vec3f, normal: vec3f) -> IncomingLight {
    let axes = axes_of(index);
    let source = light_at(index, axes, pos_world);
    let irradiance = unpack_light(results.weights[index]) * source.w;
    return IncomingLight(tile_point(index, axes, pos_world), irradiance, dot(normal, source.xyz));
}

/// Contribution of one light to the sums at a phantom.
fn phantom_term(incoming: IncomingLight, past_phantoms: f32, past_virtual: f32) -> LightSums {
    let irradiance = incoming.irradiance * incoming.cos_angle;
    return LightSums(irradiance * past_phantoms, irradiance * (past_phantoms * past_virtual), luminance(irradiance));
}

/// Sums over a subset of the directions at a phantom.
fn accumulate_phantom(pos_world: vec3f, normal: vec3f, ranks: RankSubset) -> LightSums {
    let bright = bright_directions();
    var total = LightSums();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        let incoming = incoming_light(index, pos_world, normal);
        if is_key(index) || incoming.cos_angle <= 0.0 {
            continue;
        }
        var past = vec2f(1.0);
        if rank < bright {
            let above = above_surface(incoming.point, normal, incoming.cos_angle);
            past.x = visibility(PHANTOM_CASTERS, incoming.point, above, normal);
            past.y = visibility(VIRTUAL_CASTERS, incoming.point, incoming.point.pos, normal);
        }
        total = add_sums(total, phantom_term(incoming, past.x, past.y));
    }
    return total;
}

/// Sums over key lights at a phantom.
fn accumulate_phantom_keys(pos_world: vec3f, normal: vec3f) -> LightSums {
    var total = LightSums();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_light(key, pos_world, normal);
        if incoming.cos_angle > 0.0 {
            let above = above_surface(incoming.point, normal, incoming.cos_angle);
            let past_phantoms = key_visibility(PHANTOM_CASTERS, incoming.point, above, normal);
            let past_virtual = key_visibility(VIRTUAL_CASTERS, incoming.point, incoming.point.pos, normal);
            total = add_sums(total, phantom_term(incoming, past_phantoms, past_virtual));
        }
    }
#endif
    return total;
}

/// Factor on the camera's frame at a phantom.
fn phantom_factor(total: LightSums) -> vec3f {
    let is_lit = luminance(total.unshadowed) > MIN_LIGHT_FRACTION * total.open_sky;
    let factor = total.shadowed / max(total.unshadowed, vec3f(1e-20));
    return select(vec3f(1.0), factor, vec3<bool>(is_lit) & (total.unshadowed > vec3f(0.0)));
}

fn phantom_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !is_in_virtual_shadow(pos_world, normal) {
        return vec3f(1.0);
    }
    let directions = accumulate_phantom(pos_world, normal, ALL_RANKS);
    return phantom_factor(add_sums(directions, accumulate_phantom_keys(pos_world, normal)));
}

/// Contribution of one light to the sums at a surface. Phantoms contribute their own light in place of the light they
/// hide.
fn surface_term(
    index: u32,
    incoming: IncomingLight,
    normal: vec3f,
    past_phantoms: f32,
    past_virtual: f32,
) -> LightSums {
    let weight = results.weights[index];
    // In the environment map, all lights are far away.
    let unshadowed = unpack_light(weight) * max(dot(normal, incoming.point.axes.direction), 0.0);
    let hidden = unpack_light(results.weights[dome.direction_count]) * unpack_solid_angle(weight);
    let open = mix(hidden, incoming.irradiance, past_phantoms);
    return LightSums(unshadowed, open * (past_virtual * max(incoming.cos_angle, 0.0)), 0.0);
}

/// Sums over a subset of the directions at a surface.
fn accumulate_surface(pos_world: vec3f, normal: vec3f, is_real: bool, ranks: RankSubset) -> LightSums {
    let bright = bright_directions();
    var total = LightSums();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        if is_key(index) {
            continue;
        }
        let incoming = incoming_light(index, pos_world, normal);
        var past = vec2f(1.0);
        if rank < bright && incoming.cos_angle > 0.0 {
            let above = above_surface(incoming.point, normal, incoming.cos_angle);
            past.x = visibility(PHANTOM_CASTERS, incoming.point, select(incoming.point.pos, above, is_real), normal);
            if !is_real {
                past.y = visibility(VIRTUAL_CASTERS, incoming.point, above, normal);
            }
        }
        total = add_sums(total, surface_term(index, incoming, normal, past.x, past.y));
    }
    return total;
}

/// Sums over key lights at a surface.
fn accumulate_surface_keys(pos_world: vec3f, normal: vec3f, is_real: bool) -> LightSums {
    var total = LightSums();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_light(key, pos_world, normal);
        var past = vec2f(1.0);
        if incoming.cos_angle > 0.0 {
            let above = above_surface(incoming.point, normal, incoming.cos_angle);
            past.x = key_visibility(
                PHANTOM_CASTERS, incoming.point, select(incoming.point.pos, above, is_real), normal,
            );
            if !is_real {
                past.y = key_visibility(VIRTUAL_CASTERS, incoming.point, above, normal);
            }
        }
        total = add_sums(total, surface_term(key, incoming, normal, past.x, past.y));
    }
#endif
    return total;
}

/// Light that arrives ÷ light of the open sky.
fn surface_factor(total: LightSums) -> vec3f {
    return select(vec3f(1.0), total.shadowed / max(total.unshadowed, vec3f(1e-20)), total.unshadowed > vec3f(1e-6));
}

/// Fraction of the light of the open sky that arrives at a surface.
fn sky_visibility(pos_world: vec3f, normal: vec3f, is_real: bool) -> vec3f {
    let directions = accumulate_surface(pos_world, normal, is_real, ALL_RANKS);
    return surface_factor(add_sums(directions, accumulate_surface_keys(pos_world, normal, is_real)));
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    return sky_visibility(pos_world, normal, false);
}

fn has_lamps() -> bool {
    return has_casters(LAMPS);
}

/// Luminance of a fraction of light per channel, at least 0.001.
fn luminance_fraction(fraction: vec3f) -> f32 {
    return max(luminance(fraction), 1e-3);
}

/// Fraction of the environment's light that phantoms leave to a real surface.
fn real_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !has_casters(PHANTOM_CASTERS) {
        return vec3f(1.0);
    }
    return sky_visibility(pos_world, normal, true);
}
