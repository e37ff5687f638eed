// A real thing in the picture: its depth hides virtual things, its color is the camera's under virtual shadows and lamps.

#import bevy_pbr::forward_io::{VertexOutput, FragmentOutput}
#import bevy_pbr::mesh_view_bindings::view
#import bevy_mirrorball::shadows::render::receive::phantom_ratio
#ifdef HAS_LAMPS
#import bevy_pbr::mesh_bindings::mesh
#import bevy_mirrorball::materials::lamps::{RealSurface, lamp_gain}
#endif

/// Mirror of `PhantomUniform` in phantom.rs.
struct Phantom {
    /// frame_uv = view_uv * xy + zw
    frame_uv_from_view_uv: vec4f,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var frame: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var frame_sampler: sampler;
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<uniform> phantom: Phantom;

@fragment
fn fragment(in: VertexOutput) -> FragmentOutput {
    let uv_view = (in.position.xy - view.viewport.xy) / view.viewport.zw;
    let uv_frame = uv_view * phantom.frame_uv_from_view_uv.xy + phantom.frame_uv_from_view_uv.zw;
    if any(uv_frame < vec2f(0.0)) || any(uv_frame > vec2f(1.0)) {
        discard;
    }
    var color = textureSampleLevel(frame, frame_sampler, uv_frame, 0.0).rgb;
#ifdef RECEIVES_SHADOWS
    let normal = normalize(in.world_normal);
    let ratio = phantom_ratio(in.position, in.world_position.xyz, normal);
    var light = ratio.rgb;
#ifdef HAS_LAMPS
    light += lamp_gain(RealSurface(in.position, in.world_position, normal, mesh[in.instance_index].flags), ratio.a);
#endif
    color *= light;
#endif
    return FragmentOutput(vec4f(color, 1.0));
}
