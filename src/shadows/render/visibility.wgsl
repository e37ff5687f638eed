// Fraction of the environment's light that arrives at a point, per color channel. The formulas are in shadows/mod.rs.
//
// Definitions: those of maps.wgsl, and KEY_LIGHTS: the dome may have key lights.

#define_import_path bevy_mirrorball::shadows::render::visibility

#import bevy_mirrorball::luminance::luminance
#import bevy_mirrorball::shadows::render::bindings::{dome, results}
#import bevy_mirrorball::shadows::render::dome::{unpack_light, unpack_solid_angle}
#import bevy_mirrorball::shadows::render::surfels::{BouncedLight, bounced_light}
#import bevy_mirrorball::shadows::render::maps::{
    DIRECTIONS_MAY_BE_NEAR, LitPoint, PHANTOM_CASTERS, VIRTUAL_CASTERS, above_surface, end_of_kinds, first_kind,
    has_casters, key_is_blocked, key_visibility, light_at, lit_point, visibility,
}

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
        if incoming.light.cos_angle > 0.0
            && visibility(VIRTUAL_CASTERS, incoming.point, pos_world, normal) < MIN_FULL_VISIBILITY {
            return true;
        }
    }
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_key_light(key, pos_world, normal);
        if incoming.light.cos_angle > 0.0 && key_is_blocked(incoming.point, normal) {
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
struct Light {
    /// Radiance × solid angle, scaled with the distance if the light is near, and the cosine of its angle.
    irradiance: vec3f,
    cos_angle: f32,
    /// The same in the environment map, where all lights are far away.
    map_irradiance: vec3f,
    map_cos_angle: f32,
    solid_angle: f32,
}

/// Light of one direction, and where to look up whether it arrives.
struct IncomingLight {
    light: Light,
    point: LitPoint,
}

fn incoming(index: u32, pos_world: vec3f, normal: vec3f, may_be_near: bool) -> IncomingLight {
    let point = lit_point(index, pos_world, may_be_near);
    let source = light_at(point);
    let weight = results.weights[index];
    let irradiance = unpack_light(weight);
    let light = Light(
        irradiance * source.w, dot(normal, source.xyz), irradiance, dot(normal, point.axes.direction),
        unpack_solid_angle(weight),
    );
    return IncomingLight(light, point);
}

fn incoming_light(index: u32, pos_world: vec3f, normal: vec3f) -> IncomingLight {
    return incoming(index, pos_world, normal, DIRECTIONS_MAY_BE_NEAR);
}

fn incoming_key_light(index: u32, pos_world: vec3f, normal: vec3f) -> IncomingLight {
    return incoming(index, pos_world, normal, true);
}

/// Radiance of phantoms, which they contribute in place of the light they hide.
fn hidden_radiance() -> vec3f {
    return unpack_light(results.weights[dome.direction_count]);
}

/// The same as far as surfels do not contribute it, as those of phantoms do at virtual surfaces.
fn hidden_radiance_at(is_real: bool) -> vec3f {
    return select(vec3f(0.0), hidden_radiance(), is_real || results.lit.covers_phantoms == 0u);
}

fn with_bounced_light(sums: LightSums, bounced: BouncedLight) -> LightSums {
    return LightSums(sums.unshadowed + bounced.real, sums.shadowed + bounced.now, sums.open_sky);
}

/// Contribution of one light to the sums at a phantom. `past`: its visibility past phantoms and past virtual casters.
fn phantom_term(light: Light, past: vec2f) -> LightSums {
    let irradiance = light.irradiance * light.cos_angle;
    return LightSums(irradiance * past.x, irradiance * (past.x * past.y), luminance(irradiance));
}

/// Contribution of one light to the sums at a surface.
fn surface_term(light: Light, past: vec2f, hidden: vec3f) -> LightSums {
    let unshadowed = light.map_irradiance * max(light.map_cos_angle, 0.0);
    let open = mix(hidden * light.solid_angle, light.irradiance, past.x);
    return LightSums(unshadowed, open * (past.y * max(light.cos_angle, 0.0)), 0.0);
}

/// Visibility of a direction's light at a surface past phantoms (x) and past virtual casters (y). The surface lies
/// among the casters of its own kind, above which the lookup starts. Kinds without casters take no lookup.
fn direction_visibility(incoming: IncomingLight, normal: vec3f, is_real: bool) -> vec2f {
    var past = vec2f(1.0);
    if incoming.light.cos_angle > 0.0 {
        let above = above_surface(incoming.point, normal, incoming.light.cos_angle);
        for (var kind = first_kind(); kind < end_of_kinds(); kind++) {
            let start = select(incoming.point.pos_world, above, (kind == PHANTOM_CASTERS) == is_real);
            past[1u - kind] = visibility(kind, incoming.point, start, normal);
        }
    }
    return past;
}

/// The same for a key light.
fn key_light_visibility(incoming: IncomingLight, normal: vec3f, is_real: bool) -> vec2f {
    var past = vec2f(1.0);
    if incoming.light.cos_angle > 0.0 {
        let above = above_surface(incoming.point, normal, incoming.light.cos_angle);
        for (var kind = first_kind(); kind < end_of_kinds(); kind++) {
            let start = select(incoming.point.pos_world, above, (kind == PHANTOM_CASTERS) == is_real);
            past[1u - kind] = key_visibility(kind, incoming.point, start, normal);
        }
    }
    return past;
}

/// Sums over a subset of the directions at a phantom.
fn accumulate_phantom(pos_world: vec3f, normal: vec3f, ranks: RankSubset) -> LightSums {
    let bright = bright_directions();
    var total = LightSums();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        let incoming = incoming_light(index, pos_world, normal);
        if is_key(index) || incoming.light.cos_angle <= 0.0 {
            continue;
        }
        var past = vec2f(1.0);
        if rank < bright {
            past = direction_visibility(incoming, normal, true);
        }
        total = add_sums(total, phantom_term(incoming.light, past));
    }
    return total;
}

/// Sums over key lights at a phantom.
fn accumulate_phantom_keys(pos_world: vec3f, normal: vec3f) -> LightSums {
    var total = LightSums();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_key_light(key, pos_world, normal);
        if incoming.light.cos_angle > 0.0 {
            let past = key_light_visibility(incoming, normal, true);
            total = add_sums(total, phantom_term(incoming.light, past));
        }
    }
#endif
    return total;
}

/// Factor on the camera's frame at a phantom.
fn phantom_factor(total: LightSums) -> vec3f {
    let is_lit = luminance(total.unshadowed) > MIN_LIGHT_FRACTION * total.open_sky;
    let factor = max(total.shadowed, vec3f(0.0)) / max(total.unshadowed, vec3f(1e-20));
    return select(vec3f(1.0), factor, vec3<bool>(is_lit) & (total.unshadowed > vec3f(0.0)));
}

fn phantom_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if results.lit.count == 0u && !is_in_virtual_shadow(pos_world, normal) {
        return vec3f(1.0);
    }
    let directions = accumulate_phantom(pos_world, normal, ALL_RANKS);
    let total = add_sums(directions, accumulate_phantom_keys(pos_world, normal));
    return phantom_factor(with_bounced_light(total, bounced_light(pos_world, normal, true)));
}

/// Sums over a subset of the directions at a surface. Virtual casters do not count at a real one.
fn accumulate_surface(pos_world: vec3f, normal: vec3f, is_real: bool, ranks: RankSubset) -> LightSums {
    let hidden = hidden_radiance_at(is_real);
    let bright = bright_directions();
    var total = LightSums();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        if is_key(index) {
            continue;
        }
        let incoming = incoming_light(index, pos_world, normal);
        var past = vec2f(1.0);
        if rank < bright {
            past = direction_visibility(incoming, normal, is_real);
        }
        total = add_sums(total, surface_term(incoming.light, vec2f(past.x, select(past.y, 1.0, is_real)), hidden));
    }
    return total;
}

/// Sums over key lights at a surface.
fn accumulate_surface_keys(pos_world: vec3f, normal: vec3f, is_real: bool) -> LightSums {
    var total = LightSums();
#ifdef KEY_LIGHTS
    let hidden = hidden_radiance_at(is_real);
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let incoming = incoming_key_light(key, pos_world, normal);
        let past = key_light_visibility(incoming, normal, is_real);
        total = add_sums(total, surface_term(incoming.light, vec2f(past.x, select(past.y, 1.0, is_real)), hidden));
    }
#endif
    return total;
}

/// Light that arrives ÷ light of the open sky.
fn surface_factor(total: LightSums) -> vec3f {
    let factor = max(total.shadowed, vec3f(0.0)) / max(total.unshadowed, vec3f(1e-20));
    return select(vec3f(1.0), factor, total.unshadowed > vec3f(1e-6));
}

/// Sums over all directions and key lights at a surface.
fn sky_light(pos_world: vec3f, normal: vec3f, is_real: bool) -> LightSums {
    let directions = accumulate_surface(pos_world, normal, is_real, ALL_RANKS);
    return add_sums(directions, accumulate_surface_keys(pos_world, normal, is_real));
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    let total = sky_light(pos_world, normal, false);
    return surface_factor(with_bounced_light(total, bounced_light(pos_world, normal, false)));
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
    return surface_factor(sky_light(pos_world, normal, true));
}
