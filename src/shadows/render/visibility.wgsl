// Which share of the environment's light arrives at a point, per color channel. The formulas are in mod.rs.
//
// Definitions: those of maps.wgsl, and KEY_LIGHTS: there may be some.

#define_import_path bevy_mirrorball::shadows::render::visibility

#import bevy_mirrorball::shadows::render::dome::{DomeWeight, unpack_light, unpack_solid_angle}
#import bevy_mirrorball::shadows::render::maps::{
    Aim, PHANTOM_CASTERS, VIRTUAL_CASTERS, above_surface, aim, axes_of, dome, has_casters, key_is_blocked, key_visibility,
    light_at, visibility,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> weights: array<DomeWeight>;

/// The bit beside those of casters that says that the scene has lamps of the engine.
const LAMPS: u32 = 2u;
/// Light left below this share of the open sky's counts as none; there the picture is left alone.
const LEAST_LIGHT: f32 = 1e-4;
/// Visibility from here on is full; hides the rounding of the hardware's filter.
const FULLY_VISIBLE: f32 = 0.999;

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
        let ray = look(index, pos_world, normal);
        if ray.cos_angle > 0.0 && visibility(VIRTUAL_CASTERS, ray.seen, ray.seen.pos, normal) < FULLY_VISIBLE {
            return true;
        }
    }
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let ray = look(key, pos_world, normal);
        if ray.cos_angle > 0.0 && key_is_blocked(ray.seen, normal) {
            return true;
        }
    }
#endif
    return false;
}

/// Sums over directions at a surface.
struct Tally {
    /// Light that arrives: without virtual casters at a phantom, without any casters at a virtual surface.
    before: vec3f,
    /// Of it what is left.
    after: vec3f,
    /// At a phantom the luminance of all light under an open sky.
    open_sky: f32,
}

fn sum_of(a: Tally, b: Tally) -> Tally {
    return Tally(a.before + b.before, a.after + b.after, a.open_sky + b.open_sky);
}

fn luminance(light: vec3f) -> f32 {
    return dot(light, vec3f(0.2126, 0.7152, 0.0722));
}

/// Which directions are summed up: those at every `step`th rank from the first on. Key lights are summed up by themselves.
struct Ranks {
    first: u32,
    step: u32,
}

const ALL: Ranks = Ranks(0u, 1u);

fn is_key(index: u32) -> bool {
#ifdef KEY_LIGHTS
    return index >= dome.first_key && index < dome.shadow_map_count;
#else
    return false;
#endif
}

/// A direction's light at a surface.
struct Look {
    seen: Aim,
    /// Radiance × solid angle, × what is left of it or more of it at this distance.
    light: vec3f,
    cos_angle: f32,
}

fn look(index: u32, pos_world: vec3f, normal: vec3f) -> Look {
    let axes = axes_of(index);
    let source = light_at(index, axes, pos_world);
    return Look(aim(index, axes, pos_world), unpack_light(weights[index]) * source.w, dot(normal, source.xyz));
}

/// What one light sends to a phantom past casters.
fn phantom_share(ray: Look, past_phantoms: f32, past_virtual: f32) -> Tally {
    let light = ray.light * ray.cos_angle;
    return Tally(light * past_phantoms, light * (past_phantoms * past_virtual), luminance(light));
}

/// What directions send to a phantom.
fn phantom_tally(pos_world: vec3f, normal: vec3f, ranks: Ranks) -> Tally {
    let bright = bright_directions();
    var total = Tally();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        let ray = look(index, pos_world, normal);
        if is_key(index) || ray.cos_angle <= 0.0 {
            continue;
        }
        var past = vec2f(1.0);
        if rank < bright {
            let above = above_surface(ray.seen, normal, ray.cos_angle);
            past.x = visibility(PHANTOM_CASTERS, ray.seen, above, normal);
            past.y = visibility(VIRTUAL_CASTERS, ray.seen, ray.seen.pos, normal);
        }
        total = sum_of(total, phantom_share(ray, past.x, past.y));
    }
    return total;
}

/// What key lights send to a phantom.
fn phantom_keys(pos_world: vec3f, normal: vec3f) -> Tally {
    var total = Tally();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let ray = look(key, pos_world, normal);
        if ray.cos_angle > 0.0 {
            let above = above_surface(ray.seen, normal, ray.cos_angle);
            let past_phantoms = key_visibility(PHANTOM_CASTERS, ray.seen, above, normal);
            let past_virtual = key_visibility(VIRTUAL_CASTERS, ray.seen, ray.seen.pos, normal);
            total = sum_of(total, phantom_share(ray, past_phantoms, past_virtual));
        }
    }
#endif
    return total;
}

/// Factor on the camera's picture of a phantom.
fn phantom_factor(total: Tally) -> vec3f {
    let is_lit = luminance(total.before) > LEAST_LIGHT * total.open_sky;
    let factor = total.after / max(total.before, vec3f(1e-20));
    return select(vec3f(1.0), factor, vec3<bool>(is_lit) & (total.before > vec3f(0.0)));
}

fn phantom_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !is_in_virtual_shadow(pos_world, normal) {
        return vec3f(1.0);
    }
    return phantom_factor(sum_of(phantom_tally(pos_world, normal, ALL), phantom_keys(pos_world, normal)));
}

/// What one light sends to a surface past casters; real ones send their own light instead of what they hide.
fn surface_share(index: u32, ray: Look, normal: vec3f, past_phantoms: f32, past_virtual: f32) -> Tally {
    let weight = weights[index];
    // The environment map has all its lights far away.
    let before = unpack_light(weight) * max(dot(normal, ray.seen.axes.direction), 0.0);
    let hidden = unpack_light(weights[dome.direction_count]) * unpack_solid_angle(weight);
    let open = mix(hidden, ray.light, past_phantoms);
    return Tally(before, open * (past_virtual * max(ray.cos_angle, 0.0)), 0.0);
}

/// What directions send to a surface.
fn surface_tally(pos_world: vec3f, normal: vec3f, is_real: bool, ranks: Ranks) -> Tally {
    let bright = bright_directions();
    var total = Tally();
    for (var rank = ranks.first; rank < dome.direction_count; rank += ranks.step) {
        let index = direction_at(rank);
        if is_key(index) {
            continue;
        }
        let ray = look(index, pos_world, normal);
        var past = vec2f(1.0);
        if rank < bright && ray.cos_angle > 0.0 {
            let above = above_surface(ray.seen, normal, ray.cos_angle);
            past.x = visibility(PHANTOM_CASTERS, ray.seen, select(ray.seen.pos, above, is_real), normal);
            if !is_real {
                past.y = visibility(VIRTUAL_CASTERS, ray.seen, above, normal);
            }
        }
        total = sum_of(total, surface_share(index, ray, normal, past.x, past.y));
    }
    return total;
}

/// What key lights send to a surface.
fn surface_keys(pos_world: vec3f, normal: vec3f, is_real: bool) -> Tally {
    var total = Tally();
#ifdef KEY_LIGHTS
    for (var key = dome.first_key; key < dome.shadow_map_count; key++) {
        let ray = look(key, pos_world, normal);
        var past = vec2f(1.0);
        if ray.cos_angle > 0.0 {
            let above = above_surface(ray.seen, normal, ray.cos_angle);
            past.x = key_visibility(PHANTOM_CASTERS, ray.seen, select(ray.seen.pos, above, is_real), normal);
            if !is_real {
                past.y = key_visibility(VIRTUAL_CASTERS, ray.seen, above, normal);
            }
        }
        total = sum_of(total, surface_share(key, ray, normal, past.x, past.y));
    }
#endif
    return total;
}

/// Light that arrives ÷ that of the open sky.
fn surface_factor(total: Tally) -> vec3f {
    return select(vec3f(1.0), total.after / max(total.before, vec3f(1e-20)), total.before > vec3f(1e-6));
}

fn share_of_sky(pos_world: vec3f, normal: vec3f, is_real: bool) -> vec3f {
    let directions = surface_tally(pos_world, normal, is_real, ALL);
    return surface_factor(sum_of(directions, surface_keys(pos_world, normal, is_real)));
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    return share_of_sky(pos_world, normal, false);
}

fn has_lamps() -> bool {
    return has_casters(LAMPS);
}

/// Of a share of light per channel its brightness, never quite 0.
fn brightness_left(share: vec3f) -> f32 {
    return max(luminance(share), 1e-3);
}

/// Share of the environment's light that real things leave to a real surface.
fn real_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !has_casters(PHANTOM_CASTERS) {
        return vec3f(1.0);
    }
    return share_of_sky(pos_world, normal, true);
}
