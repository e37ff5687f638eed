// Which share of the environment's light arrives at a point, per color channel. The formulas are in mod.rs.
//
// Definitions: those of maps.wgsl, and KEY_LIGHTS: there may be some.

#define_import_path bevy_mirrorball::shadows::render::visibility

#import bevy_mirrorball::shadows::render::dome::{DomeWeight, unpack_light, unpack_solid_angle}
#import bevy_mirrorball::shadows::render::maps::{
    PHANTOM_CASTERS, TilePoint, VIRTUAL_CASTERS, above_surface, axes_of, dome, has_casters, key_is_blocked,
    key_visibility, light_at, tile_point, visibility,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> weights: array<DomeWeight>;

/// The bit beside those of casters that says that the scene has lamps of the engine.
const LAMPS: u32 = 2u;
/// Light left below this share of the open sky's counts as none; there the picture is left alone.
const MIN_LIGHT_FRACTION: f32 = 1e-4;
/// Visibility from here on is full; hides the rounding of the hardware's filter.
const MIN_FULL_VISIBILITY: f32 = 0.999;

/// The directions worth a look at their shadow maps come first: how many, and which is the one at a rank.
fn bright_directions() -> u32 {
    return min(weights[dome.direction_count].ranked, dome.shadow_map_count);
}

fn direction_at(rank: u32) -> u32 {
    if rank < dome.shadow_map_count {
        return weights[rank].ranked;
    }
    return rank;
}

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

/// Sums over directions at a surface.
struct LightSums {
    /// Light that arrives: without virtual casters at a phantom, without any casters at a virtual surface.
    unshadowed: vec3f,
    /// Of it what is left.
    shadowed: vec3f,
    /// At a phantom the luminance of all light under an open sky.
    open_sky: f32,
}

fn add_sums(a: LightSums, b: LightSums) -> LightSums {
    return LightSums(a.unshadowed + b.unshadowed, a.shadowed + b.shadowed, a.open_sky + b.open_sky);
}

fn luminance(light: vec3f) -> f32 {
    return dot(light, vec3f(0.2126, 0.7152, 0.0722));
}

/// Which directions are summed up: those at every `step`th rank from the first on. Key lights are summed up by themselves.
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

/// A direction's light at a surface.
struct IncomingLight {
    point: TilePoint,
    /// Radiance × solid angle, × what is left of it or more of it at this distance.
    irradiance: vec3f,
    cos_angle: f32,
}

fn incoming_light(index: u32, pos_world: vec3f, normal: vec3f) -> IncomingLight {
    let axes = axes_of(index);
    let source = light_at(index, axes, pos_world);
    let irradiance = unpack_light(weights[index]) * source.w;
    return IncomingLight(tile_point(index, axes, pos_world), irradiance, dot(normal, source.xyz));
}

/// What one light sends to a phantom past casters.
fn phantom_term(incoming: IncomingLight, past_phantoms: f32, past_virtual: f32) -> LightSums {
    let irradiance = incoming.irradiance * incoming.cos_angle;
    return LightSums(irradiance * past_phantoms, irradiance * (past_phantoms * past_virtual), luminance(irradiance));
}

/// What directions send to a phantom.
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

/// What key lights send to a phantom.
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

/// Factor on the camera's picture of a phantom.
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

/// What one light sends to a surface past casters; real ones send their own light instead of what they hide.
fn surface_term(
    index: u32,
    incoming: IncomingLight,
    normal: vec3f,
    past_phantoms: f32,
    past_virtual: f32,
) -> LightSums {
    let weight = weights[index];
    // The environment map has all its lights far away.
    let unshadowed = unpack_light(weight) * max(dot(normal, incoming.point.axes.direction), 0.0);
    let hidden = unpack_light(weights[dome.direction_count]) * unpack_solid_angle(weight);
    let open = mix(hidden, incoming.irradiance, past_phantoms);
    return LightSums(unshadowed, open * (past_virtual * max(incoming.cos_angle, 0.0)), 0.0);
}

/// What directions send to a surface.
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

/// What key lights send to a surface.
fn accumulate_surface_keys(pos_world: vec3f, normal: vec3f, is_real: bool) -> LightSums {
    var total = LightSums();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_light(key, pos_world, normal);
        var past = vec2f(1.0);
        if incoming.cos_angle > 0.0 {
            let above = above_surface(incoming.point, normal, incoming.cos_angle);
            past.x = key_visibility(PHANTOM_CASTERS, incoming.point, select(incoming.point.pos, above, is_real), normal);
            if !is_real {
                past.y = key_visibility(VIRTUAL_CASTERS, incoming.point, above, normal);
            }
        }
        total = add_sums(total, surface_term(key, incoming, normal, past.x, past.y));
    }
#endif
    return total;
}

/// Light that arrives ÷ that of the open sky.
fn surface_factor(total: LightSums) -> vec3f {
    return select(vec3f(1.0), total.shadowed / max(total.unshadowed, vec3f(1e-20)), total.unshadowed > vec3f(1e-6));
}

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

/// Of a share of light per channel its brightness, never quite 0.
fn luminance_fraction(fraction: vec3f) -> f32 {
    return max(luminance(fraction), 1e-3);
}

/// Share of the environment's light that real things leave to a real surface.
fn real_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !has_casters(PHANTOM_CASTERS) {
        return vec3f(1.0);
    }
    return sky_visibility(pos_world, normal, true);
}
