// Phantom: a stand-in for a real object. Its depth hides virtual objects; its color is the camera frame under virtual
// shadows and lamps.

#import bevy_pbr::forward_io::{VertexOutput, FragmentOutput}
#import bevy_mirrorball::materials::phantom_frame::{frame_uv, is_unknown, phantom}
#import bevy_mirrorball::shadows::render::receive::phantom_ratio
#ifdef VISIBILITY_RANGE_DITHER
#import bevy_pbr::pbr_functions::visibility_range_dither
#endif
#ifdef ENVIRONMENT_MAP
#ifndef DEPTH_PREPASS
#import bevy_mirrorball::materials::phantom_frame::is_beyond_frame
#import bevy_mirrorball::materials::view_environment::view_radiance
#endif
#endif
#ifdef HAS_LAMPS
#import bevy_pbr::mesh_bindings::mesh
#import bevy_mirrorball::materials::lamps::{LitSurface, lamp_gain}
#endif

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var frame: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var frame_sampler: sampler;

@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    let uv_frame = frame_uv(in.position, in.world_position);
    if is_unknown(uv_frame) {
        discard;
    }
#ifdef VISIBILITY_RANGE_DITHER
    visibility_range_dither(in.position, in.visibility_range_dither);
#endif
    let normal = normalize(in.world_normal);
    var color = textureSampleLevel(frame, frame_sampler, uv_frame, 0.0).rgb;
#ifdef ENVIRONMENT_MAP
#ifndef DEPTH_PREPASS
    // Faces of light probes have no prepass.
    if is_beyond_frame(uv_frame, in.world_position.xyz, normal) {
        color = view_radiance(in.world_position.xyz - phantom.captured_from.xyz, 0.0);
    }
#endif
#endif
#ifdef RECEIVES_SHADOWS
    let ratio = phantom_ratio(in.position, in.world_position.xyz, normal);
    var light = ratio.rgb;
#ifdef HAS_LAMPS
    let flags = mesh[in.instance_index].flags;
    light += lamp_gain(LitSurface(in.position, in.world_position, normal, normal, flags), ratio.a);
#endif
    color *= light;
#endif
    return FragmentOutput(vec4f(color, phantom.alpha));
}
