// Which share of the environment's light arrives at a point, per color channel. The formulas are in mod.rs.
//
// Definitions: at most one of FILTER_NEAREST, FILTER_GAUSS, FILTER_PCF and FILTER_PCSS; without any, 2 × 2 texels are
// compared bilinearly. KEY_LIGHTS: there may be some; SPOTS: lights may be near.

#define_import_path bevy_mirrorball::shadows::visibility

#import bevy_mirrorball::shadows::dome::{
    Axes, Dome, DomeWeight, atlas_uv, project, tile_corner, tile_position, unpack_axes, unpack_light, unpack_solid_angle,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var atlas: texture_depth_2d;
@group(#{MATERIAL_BIND_GROUP}) @binding(101) var atlas_sampler: sampler_comparison;
@group(#{MATERIAL_BIND_GROUP}) @binding(102) var<storage, read> dome: Dome;
@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> weights: array<DomeWeight>;

const VIRTUAL_CASTERS: u32 = 0u;
const PHANTOM_CASTERS: u32 = 1u;
/// The bit beside those of casters that says that the scene has lamps of the engine.
const LAMPS: u32 = 2u;
/// Light left below this share of the open sky's counts as none; there the picture is left alone.
const LEAST_LIGHT: f32 = 1e-4;
/// A surface looks at its own shadow map this many texels above itself, and more by the radius of the filter.
const SELF_SHADOW_OFFSET: f32 = 1.5;
/// Visibility from here on is full; hides the rounding of the hardware's filter.
const FULLY_VISIBLE: f32 = 0.999;
/// Samples by which PCSS looks for what blocks the light.
const BLOCKER_SAMPLES: i32 = 12;
/// Samples of the penumbra that PCSS averages.
const PENUMBRA_SAMPLES: i32 = 20;
/// Rows of the matrix that turns by the golden angle.
const GOLDEN_TURN: vec4f = vec4f(-0.737369, -0.675490, 0.675490, -0.737369);
/// Depth changes by at most this much per width of a tile, for surfaces along the light.
const STEEPEST_GRADIENT: f32 = 8.0;
/// A near lamp is at most this many times as bright as where it was measured.
const NEAREST_GAIN: f32 = 1e3;

/// Share of a direction's light that reaches a position in its tile (-1…1, depth) on a surface whose depth changes by a
/// gradient, per width of the tile.
fn compare(corner: vec2f, pos: vec3f, gradient: vec2f) -> f32 {
    let depth = clamp(pos.z, 0.0, 1.0);
    let texel = 1.0 / (vec2f(dome.counts.zw) * dome.params.x);
    let center = atlas_uv(dome.counts, corner, 1.0, pos.xy);
#ifdef FILTER_NEAREST
    return textureSampleCompareLevel(atlas, atlas_sampler, (floor(center / texel) + 0.5) * texel, depth);
#else ifdef FILTER_GAUSS
    // Four bilinear comparisons half a texel off are the weights 1 2 1, 2 4 2, 1 2 1 on nine texels.
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let offset = vec2f(vec2u(i % 2u, i / 2u)) - 0.5;
        sum += textureSampleCompareLevel(atlas, atlas_sampler, center + offset * texel, depth);
    }
    return 0.25 * sum;
#else ifdef FILTER_PCF
    let radius = i32(dome.params.y);
    var sum = 0.0;
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            sum += textureSampleCompareLevel(atlas, atlas_sampler, center + vec2f(vec2i(x, y)) * texel, depth);
        }
    }
    let width = 2.0 * dome.params.y + 1.0;
    return sum / (width * width);
#else ifdef FILTER_PCSS
    return percentage_closer_soft_shadow(window(corner, 1.0, pos, gradient), dome.params.z);
#else
    return textureSampleCompareLevel(atlas, atlas_sampler, center, depth);
#endif
}

/// A key light's or soft direction's tile around a position in it.
struct Window {
    /// In the atlas: of the position, of the tile's texels, the size of the tile and of a texel.
    center: vec2f,
    low: vec2f,
    high: vec2f,
    tile: vec2f,
    texel: vec2f,
    depth: f32,
    gradient: vec2f,
}

fn window(corner: vec2f, span: f32, pos: vec3f, gradient: vec2f) -> Window {
    let texel = 1.0 / (vec2f(dome.counts.zw) * dome.params.x);
    let tile = span / vec2f(dome.counts.zw);
    let low = corner / vec2f(dome.counts.zw);
    let center = atlas_uv(dome.counts, corner, span, pos.xy);
    return Window(center, low + 0.5 * texel, low + tile - 0.5 * texel, tile, texel, clamp(pos.z, 0.0, 1.0), gradient);
}

/// Where a sample is, and the depth that the surface has there.
fn sample_place(area: Window, offset: vec2f) -> vec3f {
    let uv = clamp(area.center + offset, area.low, area.high);
    return vec3f(uv, clamp(area.depth + dot(area.gradient, (uv - area.center) / area.tile), 0.0, 1.0));
}

/// How many of the samples within a light's reach are in front of the surface, and their mean depth.
fn find_blockers(area: Window, spread: f32) -> vec2f {
    let search = max((1.0 - area.depth) * spread * area.tile, area.texel);
    var count = 0.0;
    var depth_sum = 0.0;
    var turned = vec2f(1.0, 0.0);
    for (var i = 0; i < BLOCKER_SAMPLES; i++) {
        let place = sample_place(area, turned * (search * sqrt((f32(i) + 0.5) / f32(BLOCKER_SAMPLES))));
        let found = textureLoad(atlas, vec2i(place.xy / area.texel), 0);
        if found > place.z {
            count += 1.0;
            depth_sum += found;
        }
        turned = vec2f(dot(turned, GOLDEN_TURN.xy), dot(turned, GOLDEN_TURN.zw));
    }
    return vec2f(count, depth_sum / max(count, 1.0));
}

/// Percentage-closer soft shadow (Fernando 2005). Penumbras are as wide as blockers are apart from the receiver in depth, times
/// a spread: for parallel light twice the tangent of the light's angular radius, since a tile is as deep as it is wide; the
/// depth of spots is one of inverse distances, in which the law has the same form. What is around is compared with the plane of
/// the surface, which would shadow itself otherwise. Samples lie on a spiral of Vogel (1979).
fn percentage_closer_soft_shadow(area: Window, spread: f32) -> f32 {
    let blockers = find_blockers(area, spread);
    if blockers.x == 0.0 {
        return textureSampleCompareLevel(atlas, atlas_sampler, area.center, area.depth);
    }
    let penumbra = max((blockers.y - area.depth) * spread * area.tile, area.texel);
    var sum = 0.0;
    var turned = vec2f(1.0, 0.0);
    for (var i = 0; i < PENUMBRA_SAMPLES; i++) {
        let place = sample_place(area, turned * (penumbra * sqrt((f32(i) + 0.5) / f32(PENUMBRA_SAMPLES))));
        sum += textureSampleCompareLevel(atlas, atlas_sampler, place.xy, place.z);
        turned = vec2f(dot(turned, GOLDEN_TURN.xy), dot(turned, GOLDEN_TURN.zw));
    }
    return sum / f32(PENUMBRA_SAMPLES);
}

/// A direction as a place sees it.
struct Aim {
    index: u32,
    axes: Axes,
    scale: f32,
    pos_world: vec3f,
    /// In the tile.
    pos: vec3f,
}

fn has_casters(kind: u32) -> bool {
    return (dome.served.z & (1u << kind)) != 0u;
}

fn axes_of(index: u32) -> Axes {
    return unpack_axes(dome.views[index].axes_low, dome.views[index].axes_mid, dome.views[index].axes_high);
}

/// Towards the light of a direction from a place; w: how much of its light there is of what was measured.
fn light_at(index: u32, axes: Axes, pos_world: vec3f) -> vec4f {
#ifdef SPOTS
    if dome.views[index].scale < 0.0 {
        let offset = dome.views[index].center - pos_world;
        let distance_squared = max(dot(offset, offset), 1e-8);
        let measured_at = dome.views[index].measured_at;
        let gain = select(1.0, min(measured_at * measured_at / distance_squared, NEAREST_GAIN), measured_at > 0.0);
        return vec4f(offset * inverseSqrt(distance_squared), gain);
    }
#endif
    return vec4f(axes.direction, 1.0);
}

/// The view of a direction, and where in it a place lies.
fn aim(index: u32, axes: Axes, pos_world: vec3f) -> Aim {
    let scale = dome.views[index].scale;
#ifdef SPOTS
    if scale < 0.0 {
        let pos = project(dome.views[index], pos_world);
        // What is behind a spot is outside its picture.
        return Aim(index, axes, scale, pos_world, select(vec3f(2.0), pos.xyz / pos.w, pos.w > 0.0));
    }
#endif
    return Aim(index, axes, scale, pos_world, tile_position(axes, scale, pos_world - dome.views[index].center));
}

/// How the depth of a surface changes across a tile, per width of the tile to the right and down.
fn depth_gradient(seen: Aim, normal: vec3f) -> vec2f {
    let across = vec2f(dot(seen.axes.right, normal), -dot(seen.axes.up, normal));
    var along = dot(seen.axes.direction, normal);
    var steepness = -1.0;
    if seen.scale < 0.0 {
        along = dot(normal, dome.views[seen.index].center - seen.pos_world);
        steepness = 2.0 * dome.views[seen.index].depth.x / seen.scale;
    }
    let gradient = across * (steepness / max(along, 1e-6));
    return gradient * min(1.0, STEEPEST_GRADIENT / max(length(gradient), 1e-6));
}

/// 1 where casters of a kind let the light of a direction through, 0 where they block it; at a position in the tile that is at a
/// surface or a little above.
fn visibility(kind: u32, seen: Aim, pos: vec3f, normal: vec3f) -> f32 {
    if !has_casters(kind) || any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    let corner = tile_corner(dome.views[seen.index].corners, kind);
#ifdef FILTER_PCSS
    return compare(corner, pos, depth_gradient(seen, normal));
#else
    return compare(corner, pos, vec2f(0.0));
#endif
}

/// The same for the light of a key light.
fn key_visibility(kind: u32, seen: Aim, pos: vec3f, normal: vec3f) -> f32 {
    if !has_casters(kind) || any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    let corner = tile_corner(dome.views[seen.index].corners, kind);
    let area = window(corner, dome.params.w, pos, depth_gradient(seen, normal));
    return percentage_closer_soft_shadow(area, dome.views[seen.index].spread);
}

/// Whether virtual casters may block light of a key light.
fn key_is_blocked(seen: Aim, normal: vec3f) -> bool {
    if any(abs(seen.pos.xy) > vec2f(1.0)) {
        return false;
    }
    let corner = tile_corner(dome.views[seen.index].corners, VIRTUAL_CASTERS);
    let area = window(corner, dome.params.w, seen.pos, depth_gradient(seen, normal));
    return find_blockers(area, dome.views[seen.index].spread).x > 0.0;
}

/// Position in the tile above a surface from which the surface does not shadow itself.
fn above_surface(aim: Aim, normal: vec3f, cos_angle: f32) -> vec3f {
    let sin_angle = sqrt(max(1.0 - cos_angle * cos_angle, 0.0));
    // Half the tile's texels are one unit wide.
    let texels = dome.params.x * select(1.0, dome.params.w, aim.index >= dome.served.w);
    let units = (SELF_SHADOW_OFFSET + dome.params.y) * 2.0 / texels * (0.2 + 0.8 * sin_angle);
#ifdef SPOTS
    if aim.scale < 0.0 {
        // A unit of a spot grows with the distance.
        let offset = normal * (units * distance(dome.views[aim.index].center, aim.pos_world) / -aim.scale);
        let pos = project(dome.views[aim.index], aim.pos_world + offset);
        return select(vec3f(2.0), pos.xyz / pos.w, pos.w > 0.0);
    }
#endif
    let across = vec2f(dot(aim.axes.right, normal), dot(aim.axes.up, normal));
    return aim.pos + vec3f(across, 0.5 * cos_angle) * units;
}

/// The directions worth a look at their shadow maps come first: how many, and which is the one at a rank.
fn bright_directions() -> u32 {
    return min(weights[dome.counts.y].ranked, dome.counts.x);
}

fn direction_at(rank: u32) -> u32 {
    if rank < dome.counts.x {
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
    for (var key = dome.served.w; key < dome.counts.x; key++) {
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
    return index >= dome.served.w && index < dome.counts.x;
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
    for (var rank = ranks.first; rank < dome.counts.y; rank += ranks.step) {
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
    for (var key = dome.served.w; key < dome.counts.x; key++) {
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
    let hidden = unpack_light(weights[dome.counts.y]) * unpack_solid_angle(weight);
    let open = mix(hidden, ray.light, past_phantoms);
    return Tally(before, open * (past_virtual * max(ray.cos_angle, 0.0)), 0.0);
}

/// What directions send to a surface.
fn surface_tally(pos_world: vec3f, normal: vec3f, is_real: bool, ranks: Ranks) -> Tally {
    let bright = bright_directions();
    var total = Tally();
    for (var rank = ranks.first; rank < dome.counts.y; rank += ranks.step) {
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
    for (var key = dome.served.w; key < dome.counts.x; key++) {
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
