// A rendered face and its depth → layer of the cube of a scene probe.

#import bevy_mirrorball::environment_map::cubemap::face_position

/// Mirror of `FaceUniform` in `scene_probe_pass.rs`.
struct Face {
    /// Layer of the cube.
    layer: u32,
    /// Distance of the near plane in meters.
    near: f32,
}

@group(0) @binding(0) var color: texture_2d<f32>;
@group(0) @binding(1) var depth: texture_depth_2d;
@group(0) @binding(2) var<uniform> face: Face;
@group(0) @binding(3) var cube: texture_storage_2d_array<rgba16float, write>;

@compute @workgroup_size(8, 8, 1)
fn copy_face(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(cube).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let position = face_position(id.xy, edge);
    // Reversed depth is near ÷ distance along the axis of the face.
    let reciprocal = textureLoad(depth, id.xy, 0) / (face.near * sqrt(1.0 + dot(position, position)));
    let radiance = textureLoad(color, id.xy, 0).rgb;
    textureStore(cube, id.xy, face.layer, vec4f(radiance, reciprocal));
}
