// Which share of the environment's light arrives at a point, per color channel. The formulas are in mod.rs.
//
// Definitions: at most one of FILTER_NEAREST, FILTER_GAUSS, FILTER_PCF and FILTER_PCSS; without any, 2 × 2 texels are
// compared bilinearly.

#define_import_path bevy_mirrorball::shadows::visibility

#import bevy_mirrorball::shadows::dome::{Axes, Dome, DomeWeight, atlas_uv, tile_position, unpack_axes, unpack_light}

@group(#{MATERIAL_BIND_GROUP}) @binding(100) var atlas: texture_depth_2d;
@group(#{MATERIAL_BIND_GROUP}) @binding(101) var atlas_sampler: sampler_comparison;
@group(#{MATERIAL_BIND_GROUP}) @binding(102) var<storage, read> dome: Dome;
@group(#{MATERIAL_BIND_GROUP}) @binding(103) var<storage, read> weights: array<DomeWeight>;

const VIRTUAL_CASTERS: u32 = 0u;
const PHANTOM_CASTERS: u32 = 1u;
/// Light left below this share of the open sky's counts as none; there the picture is left alone.
const LEAST_LIGHT: f32 = 1e-4;
/// A surface looks at its own shadow map this many texels above itself, and more by the radius of the filter.
const SELF_SHADOW_OFFSET: f32 = 1.5;
/// Visibility from here on is full; hides the rounding of the hardware's filter.
const FULLY_VISIBLE: f32 = 0.999;
/// Where PCSS looks for what blocks the light: a square of this many samples across.
const BLOCKER_SAMPLES: i32 = 5;
/// Samples across the penumbra that PCSS averages.
const PENUMBRA_SAMPLES: i32 = 7;

/// Share of a direction's light that reaches a position in a tile (-1…1, depth).
fn compare(tile: u32, pos: vec3f) -> f32 {
    let depth = clamp(pos.z, 0.0, 1.0);
    let tile_uv = 1.0 / vec2f(dome.counts.zw);
    let texel = tile_uv / dome.params.x;
    let center = atlas_uv(dome.counts, tile, pos.xy);
#ifdef FILTER_NEAREST
    return textureSampleCompareLevel(atlas, atlas_sampler, (floor(center / texel) + 0.5) * texel, depth);
#else ifdef FILTER_GAUSS
    // Four bilinear comparisons half a texel off are the weights 1 2 1, 2 4 2, 1 2 1 on nine texels.
    var sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let corner = vec2f(vec2u(i % 2u, i / 2u)) - 0.5;
        sum += textureSampleCompareLevel(atlas, atlas_sampler, center + corner * texel, depth);
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
    return percentage_closer_soft_shadow(tile, depth, center, texel);
#else
    return textureSampleCompareLevel(atlas, atlas_sampler, center, depth);
#endif
}

#ifdef FILTER_PCSS
/// Percentage-closer soft shadow (Fernando 2005) of a light at infinity: the penumbra is as wide as the receiver is away from
/// the mean blocker, times twice the tangent of the light's angular radius.
fn percentage_closer_soft_shadow(tile: u32, depth: f32, center: vec2f, texel: vec2f) -> f32 {
    let tile_uv = 1.0 / vec2f(dome.counts.zw);
    let corner = vec2f(vec2u(tile % dome.counts.z, tile / dome.counts.z)) * tile_uv;
    let low = corner + 0.5 * texel;
    let high = corner + tile_uv - 0.5 * texel;
    // Tile widths across a penumbra radius, per unit of depth: a tile is as deep as it is wide.
    let spread = dome.params.z;
    let search = max((1.0 - depth) * spread * tile_uv, texel);
    var blockers = 0.0;
    var blocker_depth = 0.0;
    for (var y = 0; y < BLOCKER_SAMPLES; y++) {
        for (var x = 0; x < BLOCKER_SAMPLES; x++) {
            let offset = 2.0 * vec2f(vec2i(x, y)) / f32(BLOCKER_SAMPLES - 1) - 1.0;
            let uv = clamp(center + offset * search, low, high);
            let found = textureLoad(atlas, vec2i(uv / texel), 0);
            // What lies no farther in front than the sample is off center is the receiver's own slope.
            let slope = length(offset * search / tile_uv);
            if found > depth + 0.25 * slope {
                blockers += 1.0;
                blocker_depth += found;
            }
        }
    }
    if blockers == 0.0 {
        return textureSampleCompareLevel(atlas, atlas_sampler, center, depth);
    }
    let penumbra = max((blocker_depth / blockers - depth) * spread * tile_uv, texel);
    var sum = 0.0;
    for (var y = 0; y < PENUMBRA_SAMPLES; y++) {
        for (var x = 0; x < PENUMBRA_SAMPLES; x++) {
            let offset = 2.0 * vec2f(vec2i(x, y)) / f32(PENUMBRA_SAMPLES - 1) - 1.0;
            sum += textureSampleCompareLevel(atlas, atlas_sampler, clamp(center + offset * penumbra, low, high), depth);
        }
    }
    return sum / f32(PENUMBRA_SAMPLES * PENUMBRA_SAMPLES);
}
#endif

/// A direction as a surface sees it.
struct Aim {
    index: u32,
    axes: Axes,
    scale: f32,
    /// Between the normal and the direction.
    cos_angle: f32,
    /// The surface's place in the tile.
    pos: vec3f,
}

fn has_casters(kind: u32) -> bool {
    return (dome.served.z & (1u << kind)) != 0u;
}

/// The view of a direction, and where in it a surface that faces it lies.
fn aim(index: u32, axes: Axes, cos_angle: f32, pos_world: vec3f) -> Aim {
    let scale = dome.views[index].scale;
    let pos = tile_position(axes, scale, pos_world - dome.views[index].center);
    return Aim(index, axes, scale, cos_angle, pos);
}

fn axes_of(index: u32) -> Axes {
    return unpack_axes(dome.views[index].axes_low, dome.views[index].axes_mid, dome.views[index].axes_high);
}

/// 1 where casters of a kind let the light of a direction through, 0 where they block it.
fn visibility(kind: u32, index: u32, pos: vec3f) -> f32 {
    if !has_casters(kind) || any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    return compare(kind * dome.counts.x + index, pos);
}

/// Tile position above a surface from which the surface does not shadow itself.
fn above_surface(aim: Aim, normal: vec3f) -> vec3f {
    let sin_angle = sqrt(max(1.0 - aim.cos_angle * aim.cos_angle, 0.0));
    // Half the tile's texels are one unit wide.
    let units = (SELF_SHADOW_OFFSET + dome.params.y) * 2.0 / dome.params.x * (0.2 + 0.8 * sin_angle);
    let across = vec2f(dot(aim.axes.right, normal), dot(aim.axes.up, normal));
    return aim.pos + vec3f(across, 0.5 * aim.cos_angle) * units;
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
        let axes = axes_of(index);
        if dot(normal, axes.direction) <= 0.0 {
            continue;
        }
        let seen = aim(index, axes, 0.0, pos_world);
        if visibility(VIRTUAL_CASTERS, index, seen.pos) < FULLY_VISIBLE {
            return true;
        }
    }
    return false;
}

/// Factor on the camera's picture of a phantom.
fn phantom_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !is_in_virtual_shadow(pos_world, normal) {
        return vec3f(1.0);
    }
    let bright = bright_directions();
    var open_sky = vec3f(0.0);
    var before = vec3f(0.0);
    var after = vec3f(0.0);
    for (var rank = 0u; rank < dome.counts.y; rank++) {
        let index = direction_at(rank);
        let axes = axes_of(index);
        let cos_angle = dot(normal, axes.direction);
        if cos_angle <= 0.0 {
            continue;
        }
        let light = unpack_light(weights[index]) * cos_angle;
        open_sky += light;
        if rank >= bright {
            before += light;
            after += light;
            continue;
        }
        let seen = aim(index, axes, cos_angle, pos_world);
        let real = light * visibility(PHANTOM_CASTERS, index, above_surface(seen, normal));
        before += real;
        after += real * visibility(VIRTUAL_CASTERS, index, seen.pos);
    }
    return select(vec3f(1.0), after / max(before, vec3f(1e-20)), before > LEAST_LIGHT * open_sky);
}

/// Factor on the diffuse image-based light of a virtual surface.
fn virtual_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    let phantom_light = unpack_light(weights[dome.counts.y]) * dome.params.w;
    let bright = bright_directions();
    var open_sky = vec3f(0.0);
    var arriving = vec3f(0.0);
    for (var rank = 0u; rank < dome.counts.y; rank++) {
        let index = direction_at(rank);
        let axes = axes_of(index);
        let cos_angle = dot(normal, axes.direction);
        if cos_angle <= 0.0 {
            continue;
        }
        let light = unpack_light(weights[index]);
        open_sky += light * cos_angle;
        if rank >= bright {
            arriving += light * cos_angle;
            continue;
        }
        let seen = aim(index, axes, cos_angle, pos_world);
        let past_phantoms = visibility(PHANTOM_CASTERS, index, seen.pos);
        let past_virtual = visibility(VIRTUAL_CASTERS, index, above_surface(seen, normal));
        arriving += mix(phantom_light, light, past_phantoms) * past_virtual * cos_angle;
    }
    return select(vec3f(1.0), arriving / max(open_sky, vec3f(1e-20)), open_sky > vec3f(1e-6));
}

/// Share of the environment's light that real things leave to a real surface; they send their own instead.
fn real_visibility(pos_world: vec3f, normal: vec3f) -> vec3f {
    if !has_casters(PHANTOM_CASTERS) {
        return vec3f(1.0);
    }
    let phantom_light = unpack_light(weights[dome.counts.y]) * dome.params.w;
    let bright = bright_directions();
    var open_sky = vec3f(0.0);
    var arriving = vec3f(0.0);
    for (var rank = 0u; rank < dome.counts.y; rank++) {
        let index = direction_at(rank);
        let axes = axes_of(index);
        let cos_angle = dot(normal, axes.direction);
        if cos_angle <= 0.0 {
            continue;
        }
        let light = unpack_light(weights[index]);
        open_sky += light * cos_angle;
        var past_phantoms = 1.0;
        if rank < bright {
            let seen = aim(index, axes, cos_angle, pos_world);
            past_phantoms = visibility(PHANTOM_CASTERS, index, above_surface(seen, normal));
        }
        arriving += mix(phantom_light, light, past_phantoms) * cos_angle;
    }
    return select(vec3f(1.0), arriving / max(open_sky, vec3f(1e-20)), open_sky > vec3f(1e-6));
}
