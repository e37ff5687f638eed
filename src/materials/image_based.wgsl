// StandardMaterial with dome shadows: the unshadowed fraction of the environment's light scales the diffuse term, and
// an estimate of the unshadowed reflection scales the specular term. With NEIGHBORS, mirrors reflect what is around
// them.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    pbr_functions::apply_pbr_lighting,
    pbr_types::STANDARD_MATERIAL_FLAGS_UNLIT_BIT,
}
#import bevy_mirrorball::materials::engine_features::{output_of, surface_of}
#import bevy_mirrorball::shadows::render::receive::{reflection_ratio, virtual_ratio}
#ifdef NEIGHBORS
#import bevy_mirrorball::materials::neighbors::near_reflections::{near_reflection, room_radiance}
#endif

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var pbr_input = surface_of(in, is_front);
    var color = pbr_input.material.base_color;
#ifdef NEIGHBORS
    let room = room_radiance(pbr_input);
#endif
    if (pbr_input.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) == 0u {
        let is_receiver = (pbr_input.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
        let ratio = select(vec3f(1.0), virtual_ratio(in.position, in.world_position.xyz, pbr_input.N), is_receiver);
        let near_occlusion = pbr_input.specular_occlusion;
        pbr_input.diffuse_occlusion *= ratio;
        pbr_input.specular_occlusion *=
            reflection_ratio(ratio, dot(pbr_input.N, pbr_input.V), pbr_input.material.perceptual_roughness);
        color = apply_pbr_lighting(pbr_input);
#ifdef NEIGHBORS
        color = vec4f(max(color.rgb + near_reflection(pbr_input, room, near_occlusion), vec3f(0.0)), color.a);
#endif
    }
    return output_of(pbr_input, color);
}
