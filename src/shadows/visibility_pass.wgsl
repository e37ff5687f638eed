// One thread per sample: the share of light that arrives at the surface which the prepass has seen there.

#import bevy_render::view::View
#import bevy_mirrorball::shadows::visibility::{
    brightness_left, dome, has_lamps, phantom_visibility, real_visibility, virtual_visibility,
}

@group(0) @binding(0) var<uniform> view: View;
#ifdef MULTISAMPLED
@group(0) @binding(1) var depths: texture_depth_multisampled_2d;
@group(0) @binding(2) var normals: texture_multisampled_2d<f32>;
#else
@group(0) @binding(1) var depths: texture_depth_2d;
@group(0) @binding(2) var normals: texture_2d<f32>;
#endif
@group(0) @binding(3) var map: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn see(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(map);
    if any(id.xy >= size) {
        return;
    }
    let pixel = vec2i(id.xy * dome.served.x);
    let depth = textureLoad(depths, pixel, 0);
    let facing = textureLoad(normals, pixel, 0);
    let uv = (vec2f(pixel) + 0.5 - view.viewport.xy) / view.viewport.zw;
    let pos = view.world_from_clip * vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, depth, 1.0);
    let pos_world = pos.xyz / pos.w;
    let normal = normalize(facing.xyz * 2.0 - 1.0);
    var result = vec4f(1.0);
    // What was drawn there says the normal's alpha: 0 a phantom that receives, 1 a virtual surface.
    if depth > 0.0 && facing.a < 0.1 {
        result = vec4f(phantom_visibility(pos_world, normal), 1.0);
        if has_lamps() {
            result.a = brightness_left(real_visibility(pos_world, normal));
        }
    } else if depth > 0.0 && facing.a > 0.9 {
        result = vec4f(virtual_visibility(pos_world, normal), 1.0);
    }
    textureStore(map, id.xy, result);
}
