// StandardMaterial with dome shadows: the unshadowed fraction of the environment's light scales the diffuse term, and
// an estimate of the unshadowed reflection scales the specular term, both by the weight of the measured light. With
// NEIGHBORS, mirrors reflect what is around them.

#import bevy_pbr::{
    ambient::ambient_light,
    forward_io::{FragmentOutput, VertexOutput},
    mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT,
    mesh_view_bindings::view,
    pbr_functions::{apply_pbr_lighting, calculate_F0, calculate_diffuse_color},
    pbr_types::{PbrInput, STANDARD_MATERIAL_FLAGS_UNLIT_BIT},
}
#import bevy_mirrorball::materials::engine_features::{output_of, surface_of}
#import bevy_mirrorball::shadows::render::receive::{reflection_ratio, virtual_ratio}
#ifdef NEIGHBORS
#import bevy_mirrorball::materials::neighbors::near_reflections::{near_reflection, room_radiance}
#endif

/// Mirror of `MeasuredUniform` in `image_based.rs`.
struct Measured {
    /// Fraction of the measured light that counts.
    weight: f32,
    /// Fraction of the dome's shadows that falls on the surface: 0 or 1.
    dome_shadows: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(106) var<uniform> measured: Measured;

/// Radiance of a surface under the engine's ambient light, in frame buffer units.
fn lit_by_ambient(surface: PbrInput) -> vec3f {
    let material = surface.material;
    let diffuse = calculate_diffuse_color(
        material.base_color.rgb, material.metallic, material.specular_transmission, material.diffuse_transmission,
    );
    let F0 = calculate_F0(material.base_color.rgb, material.metallic, material.reflectance);
    let NdotV = max(dot(surface.N, surface.V), 0.0001);
    return view.exposure * ambient_light(
        surface.world_position, surface.N, surface.V, NdotV, diffuse, F0, material.perceptual_roughness,
        surface.diffuse_occlusion,
    );
}

@fragment
fn fragment(in: VertexOutput, @builtin(front_facing) is_front: bool) -> FragmentOutput {
    var pbr_input = surface_of(in, is_front);
    var color = pbr_input.material.base_color;
#ifdef NEIGHBORS
    let room = room_radiance(pbr_input);
#endif
    if (pbr_input.material.flags & STANDARD_MATERIAL_FLAGS_UNLIT_BIT) == 0u {
        let is_receiver =
            (pbr_input.flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u && measured.dome_shadows > 0.0;
        let ratio = select(vec3f(1.0), virtual_ratio(in.position, in.world_position.xyz, pbr_input.N), is_receiver);
        pbr_input.diffuse_occlusion *= ratio;
        // The engine takes ambient light by the same factor as the light of the map.
        let ambient = lit_by_ambient(pbr_input) * (1.0 - measured.weight);
        pbr_input.diffuse_occlusion *= measured.weight;
        pbr_input.specular_occlusion *= measured.weight;
        let near_occlusion = pbr_input.specular_occlusion;
        pbr_input.specular_occlusion *=
            reflection_ratio(ratio, dot(pbr_input.N, pbr_input.V), pbr_input.material.perceptual_roughness);
        color = apply_pbr_lighting(pbr_input);
        color = vec4f(color.rgb + ambient, color.a);
#ifdef NEIGHBORS
        color = vec4f(max(color.rgb + near_reflection(pbr_input, room, near_occlusion), vec3f(0.0)), color.a);
#endif
    }
    return output_of(in, pbr_input, color);
}
