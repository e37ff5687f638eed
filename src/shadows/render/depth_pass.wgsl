// Draws casters into the tiles of several directions at once. Each instance is a caster seen from one direction.

#import bevy_mirrorball::shadows::render::caster::{Vertex, casters, world_position}
#import bevy_mirrorball::shadows::render::dome::{Dome, atlas_uv, project, tile_corner, tile_span}
#ifdef CUT_OUT
#import bevy_mirrorball::shadows::render::caster::{is_cut_out, mask_uv}
#endif

@group(0) @binding(0) var<storage, read> dome: Dome;
/// Number of directions to draw, then their indices.
@group(0) @binding(2) var<storage, read> refreshed: array<u32>;

struct Varyings {
    @builtin(position) position: vec4f,
    @location(0) pos_tile: vec3f,
#ifdef CUT_OUT
    @location(1) uv: vec2f,
    @location(2) @interpolate(flat) cutoff: f32,
#endif
}

/// Clip-space position in the atlas of a homogeneous position in a tile.
fn clip_position(kind: u32, index: u32, pos: vec4f) -> vec4f {
    let corner = tile_corner(dome.views[index].corners, kind);
    let span = tile_span(dome.key_span, index, dome.first_key);
    // Multiplied by w, because the division by w comes later.
    let center = atlas_uv(dome.atlas_tiles, corner, span, vec2f(0.0));
    let half_size = atlas_uv(dome.atlas_tiles, corner, span, vec2f(1.0)) - center;
    let uv = center * pos.w + half_size * pos.xy;
    return vec4f(uv.x * 2.0 - pos.w, pos.w - uv.y * 2.0, pos.z, pos.w);
}

@vertex
fn vertex(in: Vertex) -> Varyings {
    let caster = casters[in.instance / refreshed[0]];
    let direction = refreshed[1u + in.instance % refreshed[0]];
    let pos = project(dome.views[direction], world_position(caster, in));
    var out: Varyings;
    out.position = clip_position(caster.kind, direction, pos);
    out.pos_tile = vec3f(pos.xy, pos.w);
#ifdef CUT_OUT
    out.uv = mask_uv(caster, in);
    out.cutoff = caster.cutoff;
#endif
    return out;
}

/// Discards what lies outside the tile, so that nothing is drawn into a neighboring tile.
@fragment
fn fragment(in: Varyings) {
#ifdef CUT_OUT
    if is_cut_out(in.uv, in.cutoff) {
        discard;
    }
#endif
    if any(abs(in.pos_tile.xy) > vec2f(in.pos_tile.z)) {
        discard;
    }
}

/// Two triangles over a tile at the farthest depth. Each instance is one of the refreshed tiles.
@vertex
fn clear(@builtin(instance_index) instance: u32, @builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let direction = refreshed[1u + instance % refreshed[0]];
    let kind = instance / refreshed[0];
    let right = f32(index == 1u || index == 2u || index == 4u);
    let top = f32(index == 2u || index == 4u || index == 5u);
    return clip_position(kind, direction, vec4f(vec2f(right, top) * 2.0 - 1.0, 0.0, 1.0));
}
