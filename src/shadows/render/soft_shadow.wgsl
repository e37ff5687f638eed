// Percentage-closer soft shadows (Fernando 2005), for key lights and for the filter of that name.

#define_import_path bevy_mirrorball::shadows::render::soft_shadow

#import bevy_mirrorball::shadows::render::bindings::{atlas, atlas_sampler, dome, results}
#import bevy_mirrorball::shadows::render::depth_pyramid::{LEVELS, blocks_of_level, level_start}
#import bevy_mirrorball::shadows::render::dome::atlas_uv

/// Samples of the blocker search.
const BLOCKER_SAMPLES: i32 = 12;
/// Samples of the penumbra that are averaged.
const PENUMBRA_SAMPLES: i32 = 20;
/// Rows of the rotation matrix by the golden angle.
const GOLDEN_TURN: vec4f = vec4f(-0.737369, -0.675490, 0.675490, -0.737369);
/// Blocks of a depth pyramid across the square that is searched; on the coarsest level there may be more.
const SEARCHED_BLOCKS: f32 = 3.0;
/// Maximum number of times that the square is made smaller.
const MAX_NARROWINGS: i32 = 3;
/// Fraction of its size to which a square has to shrink for another try.
const MIN_NARROWING: f32 = 0.7;

/// Window of a tile around a position.
struct Window {
    /// Texture coordinates of the position.
    center: vec2f,
    /// Texture coordinates of the centers of the tile's first and last texel.
    low: vec2f,
    high: vec2f,
    /// Size of the tile and of a texel in texture coordinates.
    tile: vec2f,
    texel: vec2f,
    depth: f32,
    /// Change of the surface's depth per width of the tile.
    gradient: vec2f,
}

fn window(corner: vec2f, span: f32, pos: vec3f, gradient: vec2f) -> Window {
    let texel = 1.0 / (vec2f(dome.atlas_tiles) * dome.tile_resolution);
    let tile = span / vec2f(dome.atlas_tiles);
    let low = corner / vec2f(dome.atlas_tiles);
    let center = atlas_uv(dome.atlas_tiles, corner, span, pos.xy);
    return Window(center, low + 0.5 * texel, low + tile - 0.5 * texel, tile, texel, clamp(pos.z, 0.0, 1.0), gradient);
}

/// Radius of the penumbra in tile widths that a blocker at a depth throws on a surface. For parallel light the scale is
/// the tangent of the light's angular radius, because a tile is as deep as it is wide. In perspective the depth is one
/// of inverse distances, for which the law has the same form.
fn penumbra_radius(area: Window, blocker_depth: f32, penumbra_scale: f32) -> f32 {
    return max((blocker_depth - area.depth) * penumbra_scale, area.texel.x / area.tile.x);
}

/// What can block a light at a position.
struct BlockerRange {
    /// Radius in tile widths around the position within which all blockers are.
    radius: f32,
    /// Upper bound of their depth; 0 if there are none.
    nearest: f32,
}

/// Depth nearest to the light in a square of a tile. At least the blocks that the square touches are searched.
fn nearest_depth(first_block: u32, center: vec2f, radius: f32) -> f32 {
    var level = 0u;
    while level < LEVELS - 1u && 2.0 * radius * f32(blocks_of_level(level)) > SEARCHED_BLOCKS {
        level++;
    }
    let edge = blocks_of_level(level);
    let first = first_block + level_start(level);
    let low = vec2u(clamp((center - radius) * f32(edge), vec2f(0.0), vec2f(f32(edge - 1u))));
    let high = vec2u(clamp((center + radius) * f32(edge), vec2f(0.0), vec2f(f32(edge - 1u))));
    var nearest = 0.0;
    for (var y = low.y; y <= high.y; y++) {
        for (var x = low.x; x <= high.x; x++) {
            nearest = max(nearest, results.pyramids[first + y * edge + x]);
        }
    }
    return nearest;
}

/// Narrows the search for blockers: a blocker at a depth can only lie within its penumbra's radius, so the nearest one
/// in a square bounds the radius anew.
fn blocker_range(area: Window, first_block: u32, penumbra_scale: f32) -> BlockerRange {
    let center = (area.center - area.low + 0.5 * area.texel) / area.tile;
    var range = BlockerRange(penumbra_radius(area, 1.0, penumbra_scale), 1.0);
    for (var i = 0; i <= MAX_NARROWINGS; i++) {
        let nearest = nearest_depth(first_block, center, range.radius);
        if nearest <= area.depth {
            return BlockerRange(0.0, 0.0);
        }
        let radius = penumbra_radius(area, nearest, penumbra_scale);
        let is_settled = radius > MIN_NARROWING * range.radius;
        range = BlockerRange(min(radius, range.radius), nearest);
        if is_settled {
            break;
        }
    }
    return range;
}

/// Texture coordinates of a sample, and the depth of the surface there.
fn sample_place(area: Window, offset: vec2f) -> vec3f {
    let uv = clamp(area.center + offset, area.low, area.high);
    return vec3f(uv, clamp(area.depth + dot(area.gradient, (uv - area.center) / area.tile), 0.0, 1.0));
}

/// Number of samples within a radius that are in front of the surface, and their mean depth. Samples are compared with
/// the plane of the surface, which would otherwise shadow itself, and lie on a spiral (Vogel 1979).
fn sample_blockers(area: Window, radius: f32) -> vec2f {
    var count = 0.0;
    var depth_sum = 0.0;
    var turned = vec2f(1.0, 0.0);
    for (var i = 0; i < BLOCKER_SAMPLES; i++) {
        let place = sample_place(area, turned * (radius * area.tile * sqrt((f32(i) + 0.5) / f32(BLOCKER_SAMPLES))));
        let found = textureLoad(atlas, vec2i(place.xy / area.texel), 0);
        if found > place.z {
            count += 1.0;
            depth_sum += found;
        }
        turned = vec2f(dot(turned, GOLDEN_TURN.xy), dot(turned, GOLDEN_TURN.zw));
    }
    return vec2f(count, depth_sum / max(count, 1.0));
}

/// Fraction of samples within a radius that the light reaches.
fn sample_light(area: Window, radius: f32) -> f32 {
    var sum = 0.0;
    var turned = vec2f(1.0, 0.0);
    for (var i = 0; i < PENUMBRA_SAMPLES; i++) {
        let place = sample_place(area, turned * (radius * area.tile * sqrt((f32(i) + 0.5) / f32(PENUMBRA_SAMPLES))));
        sum += textureSampleCompareLevel(atlas, atlas_sampler, place.xy, place.z);
        turned = vec2f(dot(turned, GOLDEN_TURN.xy), dot(turned, GOLDEN_TURN.zw));
    }
    return sum / f32(PENUMBRA_SAMPLES);
}

/// Soft shadow of a light without a depth pyramid. Things that are thin beside the distance of the nearest possible
/// blocker may be missed.
fn soft_shadow(area: Window, penumbra_scale: f32) -> f32 {
    let blockers = sample_blockers(area, penumbra_radius(area, 1.0, penumbra_scale));
    if blockers.x == 0.0 {
        return textureSampleCompareLevel(atlas, atlas_sampler, area.center, area.depth);
    }
    return sample_light(area, penumbra_radius(area, blockers.y, penumbra_scale));
}

/// Soft shadow of a key light. Where samples miss a thin blocker, the depth pyramid stands in for them.
fn key_soft_shadow(area: Window, first_block: u32, penumbra_scale: f32) -> f32 {
    let range = blocker_range(area, first_block, penumbra_scale);
    if range.nearest == 0.0 {
        return 1.0;
    }
    let blockers = sample_blockers(area, range.radius);
    let depth = select(range.nearest, blockers.y, blockers.x > 0.0);
    return sample_light(area, penumbra_radius(area, depth, penumbra_scale));
}

/// Whether a part of a key light may be blocked.
fn key_may_be_blocked(area: Window, first_block: u32, penumbra_scale: f32) -> bool {
    return blocker_range(area, first_block, penumbra_scale).nearest > 0.0;
}
