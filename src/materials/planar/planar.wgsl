// Multiplies a receiver of planar shadows by the fraction of light that is left.

#import bevy_pbr::forward_io::VertexOutput

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var ratio_texture: texture_2d<f32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var ratio_sampler: sampler;
/// Scale and offset from coordinates of the rectangle to those of the texture.
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<uniform> texture_from_rectangle: vec4f;

@fragment
fn fragment(in: VertexOutput) -> @location(0) vec4f {
    let uv = in.uv * texture_from_rectangle.xy + texture_from_rectangle.zw;
    let ratio = textureSampleLevel(ratio_texture, ratio_sampler, uv, 0.0).rgb;
    let is_covered = all(uv >= vec2f(0.0)) && all(uv <= vec2f(1.0));
    return vec4f(select(vec3f(1.0), max(ratio, vec3f(0.0)), is_covered), 1.0);
}
