// Draws casters into the tiles of several directions at once. Each instance is a caster seen from one direction.

#import bevy_mirrorball::shadows::render::dome::{Dome, atlas_uv, project, tile_corner, tile_span}

/// Mirror of `CasterUniform` in `caster_buffers.rs`.
struct Caster {
    world_from_local: mat4x4f,
    /// Rows of the matrix that maps texture coordinates.
    uv_x: vec4f,
    uv_y: vec4f,
    /// 0 for a virtual caster, 1 for a phantom.
    kind: u32,
    first_joint: u32,
    first_morph_weight: u32,
    morph_targets: u32,
    /// First vertex of the mesh in its buffer, to number its vertices from 0.
    first_vertex: u32,
    vertex_count: u32,
    first_morph_displacement: u32,
    /// Minimum alpha of the texture where something is drawn.
    cutoff: f32,
}

/// Mirror of Bevy's `MorphAttributes`.
struct MorphDisplacement {
    position: vec3f,
    normal: vec3f,
    tangent: vec3f,
}

@group(0) @binding(0) var<storage, read> dome: Dome;
@group(0) @binding(1) var<storage, read> casters: array<Caster>;
/// Number of directions to draw, then their indices.
@group(0) @binding(2) var<storage, read> refreshed: array<u32>;
@group(0) @binding(3) var<storage, read> joints: array<mat4x4f>;
@group(0) @binding(4) var<storage, read> morph_weights: array<f32>;
#ifdef MORPHED
@group(1) @binding(0) var<storage, read> morph_displacements: array<MorphDisplacement>;
#endif
#ifdef CUT_OUT
@group(#{CUTOUT_GROUP}) @binding(0) var mask_texture: texture_2d<f32>;
@group(#{CUTOUT_GROUP}) @binding(1) var mask_sampler: sampler;
#endif

struct Vertex {
    @builtin(instance_index) instance: u32,
    @builtin(vertex_index) index: u32,
    @location(0) position: vec3f,
#ifdef SKINNED
    @location(1) joint_indices: vec4u,
    @location(2) joint_weights: vec4f,
#endif
#ifdef CUT_OUT
    @location(3) uv: vec2f,
#endif
}

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
    var position = in.position;
#ifdef MORPHED
    for (var i = 0u; i < caster.morph_targets; i++) {
        let at = caster.first_morph_displacement + i * caster.vertex_count + in.index - caster.first_vertex;
        position += morph_weights[caster.first_morph_weight + i] * morph_displacements[at].position;
    }
#endif
#ifdef SKINNED
    let world_from_local = in.joint_weights.x * joints[caster.first_joint + in.joint_indices.x]
        + in.joint_weights.y * joints[caster.first_joint + in.joint_indices.y]
        + in.joint_weights.z * joints[caster.first_joint + in.joint_indices.z]
        + in.joint_weights.w * joints[caster.first_joint + in.joint_indices.w];
#else
    let world_from_local = caster.world_from_local;
#endif
    let pos_world = world_from_local * vec4f(position, 1.0);
    let pos = project(dome.views[direction], pos_world.xyz);
    var out: Varyings;
    out.position = clip_position(caster.kind, direction, pos);
    out.pos_tile = vec3f(pos.xy, pos.w);
#ifdef CUT_OUT
    let uv = vec3f(in.uv, 1.0);
    out.uv = vec2f(dot(caster.uv_x.xyz, uv), dot(caster.uv_y.xyz, uv));
    out.cutoff = caster.cutoff;
#endif
    return out;
}

/// Discards what lies outside the tile, so that nothing is drawn into a neighboring tile.
@fragment
fn fragment(in: Varyings) {
#ifdef CUT_OUT
    if textureSample(mask_texture, mask_sampler, in.uv).a < in.cutoff {
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
