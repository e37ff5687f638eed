// Multiplies a receiver of planar shadows by the fraction of light that is left.

#import bevy_pbr::forward_io::VertexOutput

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var ratio_texture: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var ratio_sampler: sampler;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4f {
    let ratio = textureSampleLevel(ratio_texture, ratio_sampler, in.uv, 0.0).rgb;
    return vec4f(max(ratio, vec3f(0.0)), 1.0);
}
