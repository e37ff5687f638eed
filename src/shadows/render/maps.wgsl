// Lookups of the dome's shadow maps: the visibility of a direction's light from a position.
//
// Definitions: at most one of FILTER_NEAREST, FILTER_GAUSS, FILTER_PCF and FILTER_PCSS; without any of them, 2 × 2
// texels are compared bilinearly. SPOTS: some views of directions may be in perspective, as those of key lights always
// may.

#define_import_path bevy_mirrorball::shadows::render::maps

#import bevy_mirrorball::shadows::render::bindings::{atlas, atlas_sampler, dome}
#import bevy_mirrorball::shadows::render::depth_pyramid::pyramid_start
#import bevy_mirrorball::shadows::render::dome::{
    Axes, atlas_uv, near_position, tile_corner, tile_position, tile_span, unpack_axes,
}
#import bevy_mirrorball::shadows::render::soft_shadow::{
    Window, key_may_be_blocked, key_soft_shadow, soft_shadow, window,
}

const VIRTUAL_CASTERS: u32 = 0u;
const PHANTOM_CASTERS: u32 = 1u;
/// Number of the bit of `scene_flags` for lamps of the engine. The bits below are for the kinds of casters.
const LAMPS: u32 = 2u;
/// Offset of a surface in texels against shadows on itself, to which the radius of the filter is added.
const SELF_SHADOW_OFFSET: f32 = 1.5;
/// Maximum change of depth per width of a tile, for surfaces that are nearly parallel to the light.
const MAX_DEPTH_GRADIENT: f32 = 8.0;
/// Maximum brightness of a near lamp, relative to the position at which it was measured.
const MAX_NEAR_GAIN: f32 = 1e3;

/// Fraction of a direction's light that reaches a position in its tile (xy -1…1, depth). `gradient` is the change of
/// the surface's depth per width of the tile.
fn compare(corner: vec2f, pos: vec3f, gradient: vec2f) -> f32 {
    let depth = clamp(pos.z, 0.0, 1.0);
    let texel = 1.0 / (vec2f(dome.atlas_tiles) * dome.tile_resolution);
    let center = atlas_uv(dome.atlas_tiles, corner, 1.0, pos.xy);
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
    let radius = i32(dome.filter_radius);
    var sum = 0.0;
    for (var y = -radius; y <= radius; y++) {
        for (var x = -radius; x <= radius; x++) {
            sum += textureSampleCompareLevel(atlas, atlas_sampler, center + vec2f(vec2i(x, y)) * texel, depth);
        }
    }
    let width = 2.0 * dome.filter_radius + 1.0;
    return sum / (width * width);
#else ifdef FILTER_PCSS
    return soft_shadow(window(corner, 1.0, pos, gradient), dome.tangent_radius);
#else
    return textureSampleCompareLevel(atlas, atlas_sampler, center, depth);
#endif
}

/// A position in the world and the light of a direction.
struct LitPoint {
    index: u32,
    axes: Axes,
    scale: f32,
    /// Whether the light is near, so that its view is in perspective.
    is_near: bool,
    pos_world: vec3f,
}

#ifdef SPOTS
const DIRECTIONS_MAY_BE_NEAR: bool = true;
#else
const DIRECTIONS_MAY_BE_NEAR: bool = false;
#endif

/// `may_be_near` is a constant where the function is called, which leaves out the code for near lights if it is false.
fn lit_point(index: u32, pos_world: vec3f, may_be_near: bool) -> LitPoint {
    let scale = dome.views[index].scale;
    return LitPoint(index, axes_of(index), scale, may_be_near && scale < 0.0, pos_world);
}

fn has_casters(kind: u32) -> bool {
    return (dome.scene_flags & (1u << kind)) != 0u;
}

fn has_lamps() -> bool {
    return has_casters(LAMPS);
}

/// Kinds of casters that are in the atlas: a range, so that a loop over it leaves out the lookups of absent kinds. A
/// branch would not: software rasterizers pay for both sides.
fn first_kind() -> u32 {
    return select(PHANTOM_CASTERS, VIRTUAL_CASTERS, has_casters(VIRTUAL_CASTERS));
}

fn end_of_kinds() -> u32 {
    return select(VIRTUAL_CASTERS, PHANTOM_CASTERS, has_casters(PHANTOM_CASTERS)) + 1u;
}

fn axes_of(index: u32) -> Axes {
    return unpack_axes(dome.views[index].axes_low, dome.views[index].axes_mid, dome.views[index].axes_high);
}

/// Unit vector from a point towards its light; w: the light there relative to the measured light.
fn light_at(point: LitPoint) -> vec4f {
    if point.is_near {
        let offset = dome.views[point.index].center - point.pos_world;
        let distance_squared = max(dot(offset, offset), 1e-8);
        let measured_at = dome.views[point.index].measured_at;
        let gain = select(1.0, min(measured_at * measured_at / distance_squared, MAX_NEAR_GAIN), measured_at > 0.0);
        return vec4f(offset * inverseSqrt(distance_squared), gain);
    }
    return vec4f(point.axes.direction, 1.0);
}

/// Position in the tile of a light of a position in the world near a point: xy -1…1 (+y up), z 0…1, larger is nearer to
/// the light.
fn position_in_tile(point: LitPoint, pos_world: vec3f) -> vec3f {
    let offset = pos_world - dome.views[point.index].center;
    if point.is_near {
        let pos = near_position(point.axes, point.scale, dome.views[point.index].depth, offset);
        // Positions behind the light are outside the tile.
        return select(vec3f(2.0), pos.xyz / pos.w, pos.w > 0.0);
    }
    return tile_position(point.axes, point.scale, offset);
}

/// Change of a surface's depth per width of the tile, to the right and down.
fn depth_gradient(point: LitPoint, normal: vec3f) -> vec2f {
    let across = vec2f(dot(point.axes.right, normal), -dot(point.axes.up, normal));
    var along = dot(point.axes.direction, normal);
    var steepness = -1.0;
    if point.is_near {
        along = dot(normal, dome.views[point.index].center - point.pos_world);
        steepness = 2.0 * dome.views[point.index].depth.x / point.scale;
    }
    let gradient = across * (steepness / max(along, 1e-6));
    return gradient * min(1.0, MAX_DEPTH_GRADIENT / max(length(gradient), 1e-6));
}

/// Visibility of a direction's light past casters of a kind: 1 if it arrives, 0 if it is blocked. The lookup starts at
/// a position in the world, on the surface or slightly above it.
fn visibility(kind: u32, point: LitPoint, start: vec3f, normal: vec3f) -> f32 {
    let pos = position_in_tile(point, start);
    if !has_casters(kind) || any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    let corner = tile_corner(dome.views[point.index].corners, kind);
#ifdef FILTER_PCSS
    return compare(corner, pos, depth_gradient(point, normal));
#else
    return compare(corner, pos, vec2f(0.0));
#endif
}

fn key_window(kind: u32, point: LitPoint, pos: vec3f, normal: vec3f) -> Window {
    let corner = tile_corner(dome.views[point.index].corners, kind);
    return window(corner, dome.key_span, pos, depth_gradient(point, normal));
}

/// Visibility of a key light past casters of a kind.
fn key_visibility(kind: u32, point: LitPoint, start: vec3f, normal: vec3f) -> f32 {
    let pos = position_in_tile(point, start);
    if !has_casters(kind) || any(abs(pos.xy) > vec2f(1.0)) {
        return 1.0;
    }
    let area = key_window(kind, point, pos, normal);
    let first_block = pyramid_start(point.index - dome.first_key, kind);
    return key_soft_shadow(area, first_block, dome.views[point.index].penumbra_scale);
}

/// Whether virtual casters may block a part of a key light.
fn key_is_blocked(point: LitPoint, normal: vec3f) -> bool {
    let pos = position_in_tile(point, point.pos_world);
    if any(abs(pos.xy) > vec2f(1.0)) {
        return false;
    }
    let area = key_window(VIRTUAL_CASTERS, point, pos, normal);
    let first_block = pyramid_start(point.index - dome.first_key, VIRTUAL_CASTERS);
    return key_may_be_blocked(area, first_block, dome.views[point.index].penumbra_scale);
}

/// Position in the world slightly above a surface, so that the surface does not shadow itself.
fn above_surface(point: LitPoint, normal: vec3f, cos_angle: f32) -> vec3f {
    let sin_angle = sqrt(max(1.0 - cos_angle * cos_angle, 0.0));
    let texels = dome.tile_resolution * tile_span(dome.key_span, point.index, dome.first_key);
    // The tile is two units wide.
    let units = (SELF_SHADOW_OFFSET + dome.filter_radius) * 2.0 / texels * (0.2 + 0.8 * sin_angle);
    var unit = 1.0 / abs(point.scale);
    if point.is_near {
        // In perspective, a unit grows with the distance.
        unit *= distance(dome.views[point.index].center, point.pos_world);
    }
    return point.pos_world + normal * (units * unit);
}
