// Phantom in the prepass, drawn only inside the camera frame. The alpha of the normal encodes for the visibility pass
// whether the phantom receives shadows. Its motion vectors are those of the camera frame, whatever the phantom does.

#import bevy_pbr::prepass_io::VertexOutput
#import bevy_mirrorball::shadows::render::samples::{IS_HIDING, IS_PHANTOM}
#ifdef PREPASS_FRAGMENT
#import bevy_mirrorball::materials::phantom_frame::{frame_uv, is_unknown}
#import bevy_pbr::prepass_io::FragmentOutput
#endif
#ifdef MOTION_VECTOR_PREPASS
#import bevy_mirrorball::materials::phantom_frame::phantom
#endif
#ifdef VISIBILITY_RANGE_DITHER
#import bevy_pbr::pbr_functions::visibility_range_dither
#endif

#ifdef PREPASS_FRAGMENT
@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    if is_unknown(frame_uv(in.position, in.world_position)) {
        discard;
    }
#ifdef VISIBILITY_RANGE_DITHER
    visibility_range_dither(in.position, in.visibility_range_dither);
#endif
    var out: FragmentOutput;
#ifdef MOTION_VECTOR_PREPASS
    out.motion_vector = phantom.motion;
#endif
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
