// Maps of a light probe, and the distances in its cube → the buffer that materials read.

#import bevy_mirrorball::environment_map::cubemap::{FaceTexel, texel_across_edge}
#import bevy_mirrorball::materials::neighbors::cube_layout::{level_start, padded_edge}

/// All levels of the specular map.
@group(0) @binding(0) var specular: texture_2d_array<f32>;
/// Cube of the scene probe; alpha is the reciprocal distance.
@group(0) @binding(1) var scene: texture_2d_array<f32>;
/// Index of the first texel in the buffer.
@group(0) @binding(2) var<uniform> first_texel: u32;
@group(0) @binding(3) var<storage, read_write> texels: array<vec2u>;

/// Mean reciprocal distance of the texels of the cube in a texel of a level.
fn mean_reciprocal(found: FaceTexel, level: u32) -> f32 {
    let across = 1 << level;
    var sum = 0.0;
    for (var y = 0; y < across; y++) {
        for (var x = 0; x < across; x++) {
            sum += textureLoad(scene, found.texel * across + vec2i(x, y), found.face, 0u).a;
        }
    }
    return sum / f32(across * across);
}

/// One texel, with z counting faces and then levels.
@compute @workgroup_size(8, 8, 1)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(specular).x;
    let level = id.z / 6u;
    let face = id.z % 6u;
    let padded = padded_edge(edge, level);
    if any(id.xy >= vec2u(padded)) {
        return;
    }
    let last = vec2i(i32(edge >> level) - 1);
    var inner = vec2i(id.xy) - 1;
    // There is nothing beyond a corner.
    let is_corner = all((inner < vec2i(0)) | (inner > last));
    inner = select(inner, clamp(inner, vec2i(0), last), is_corner);
    let found = texel_across_edge(face, inner, i32(edge >> level));
    let radiance = textureLoad(specular, found.texel, found.face, level).rgb;
    let index = first_texel + level_start(edge, level) + (face * padded + id.y) * padded + id.x;
    texels[index] = vec2u(pack2x16float(radiance.rg), pack2x16float(vec2f(radiance.b, mean_reciprocal(found, level))));
}
