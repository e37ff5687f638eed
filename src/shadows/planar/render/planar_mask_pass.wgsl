// Draws casters, projected onto a receiver from one point of a light, into a mask of what the light does not reach.
// Each instance is a caster seen from one point.

#import bevy_mirrorball::shadows::planar::render::planar_view::PlanarView
#import bevy_mirrorball::shadows::render::caster::{Vertex, casters, world_position}
#ifdef CUT_OUT
#import bevy_mirrorball::shadows::render::caster::{is_cut_out, mask_uv}
#endif

@group(0) @binding(0) var<storage, read> views: array<PlanarView>;
/// Number of views.
@group(0) @binding(2) var<storage, read> counts: array<u32>;

struct Varyings {
    @builtin(position) position: vec4f,
    /// Above the receiver, in meters.
    @location(0) height: f32,
    @location(1) @interpolate(flat) weight: vec3f,
#ifdef CUT_OUT
    @location(2) uv: vec2f,
    @location(3) @interpolate(flat) cutoff: f32,
#endif
}

@vertex
fn vertex(in: Vertex) -> Varyings {
    let caster = casters[in.instance / counts[0]];
    let view = views[in.instance % counts[0]];
    let pos = vec4f(world_position(caster, in), 1.0);
    var out: Varyings;
    // What is beyond a near light gets w below 0 and is clipped: no anti-shadows.
    out.position = view.clip_from_world * pos;
    out.position.z = 0.0;
    out.height = dot(view.plane, pos);
    out.weight = view.weight;
#ifdef CUT_OUT
    out.uv = mask_uv(caster, in);
    out.cutoff = caster.cutoff;
#endif
    return out;
}

/// Discards what is behind the receiver, whose shadow would be a false one.
@fragment
fn fragment(in: Varyings) -> @location(0) vec4f {
#ifdef CUT_OUT
    if is_cut_out(in.uv, in.cutoff) {
        discard;
    }
#endif
    if in.height <= 0.0 {
        discard;
    }
    return vec4f(in.weight, 0.0);
}
