// A phantom in the prepass: where the camera has a picture; the normal's alpha tells the visibility pass what it is.

#import bevy_pbr::prepass_io::VertexOutput
#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::shadows::render::samples::{IS_HIDING, IS_PHANTOM}
#ifdef PREPASS_FRAGMENT
#import bevy_pbr::prepass_io::FragmentOutput
#endif

/// Mirror of `PhantomUniform` in phantom.rs.
struct Phantom {
    /// frame_uv = view_uv * xy + zw
    frame_uv_from_view_uv: vec4f,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<uniform> phantom: Phantom;

#ifdef PREPASS_FRAGMENT
@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    let uv_view = (in.position.xy - view.viewport.xy) / view.viewport.zw;
    let uv_frame = uv_view * phantom.frame_uv_from_view_uv.xy + phantom.frame_uv_from_view_uv.zw;
    if any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0)) {
        discard;
    }
    var out: FragmentOutput;
#ifdef NORMAL_PREPASS
#ifdef RECEIVES_SHADOWS
    out.normal = vec4f(normalize(in.world_normal) * 0.5 + 0.5, IS_PHANTOM);
#else
    out.normal = vec4f(normalize(in.world_normal) * 0.5 + 0.5, IS_HIDING);
#endif
#endif
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.frag_depth = in.unclipped_depth;
#endif
    return out;
}
#endif
