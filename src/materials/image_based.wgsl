// StandardMaterial under dome shadows: the share of the environment's light that arrives scales the diffuse part.

#import bevy_pbr::{
    forward_io::{FragmentOutput, VertexOutput},
    pbr_fragment::pbr_input_from_standard_material,
    pbr_functions::{alpha_discard, apply_pbr_lighting, main_pass_post_lighting_processing},
    pbr_types::STANDARD_MATERIAL_FLAGS_UNLIT_BIT,
}
#import bevy_mirrorball::shadows::receive::virtual_ratio

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var pbr_input = pbr_input_from_standard_material(in, is_front);
    pbr_input.material.base_color = alpha_discard(pbr_input.material, pbr_input.material.base_color);
    var color = pbr_input.material.base_color;
    if (pbr_input.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) == 0u {
        pbr_input.diffuse_occlusion *= virtual_ratio(in.position, in.world_position.xyz, pbr_input.N);
        color = apply_pbr_lighting(pbr_input);
    }
    return FragmentOutput(main_pass_post_lighting_processing(pbr_input, color));
}
