// Draws casters into the tiles of all directions at once: an instance is a caster seen from one direction.

#import bevy_mirrorball::shadows::dome::{Dome, atlas_uv, view_position}

/// Mirror of `CasterUniform` in depth_pass.rs.
struct Caster {
    world_from_local: mat4x4f,
    /// 0 virtual, 1 phantom.
    kind: u32,
}

@group(0) @binding(0) var<storage, read> dome: Dome;
@group(0) @binding(1) var<storage, read> casters: array<Caster>;

struct Varyings {
    @builtin(position) position: vec4f,
    @location(0) pos_tile: vec2f,
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) pos_local: vec3f) -> Varyings {
    let caster = casters[instance / dome.counts.x];
    let index = instance % dome.counts.x;
    let pos_world = caster.world_from_local * vec4f(pos_local, 1.0);
    let pos = view_position(dome.views[index], pos_world.xyz);
    let uv = atlas_uv(dome.counts, caster.kind * dome.counts.x + index, pos.xy);
    return Varyings(vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, pos.z, 1.0), pos.xy);
}

/// Nothing may be drawn into a neighbor's tile.
@fragment
fn fragment(in: Varyings) {
    if any(abs(in.pos_tile) > vec2f(1.0)) {
        discard;
    }
}
