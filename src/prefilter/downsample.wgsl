// Pyramid of padded faces: the environment cube at half its resolution and less.
//
// COPIES: `halve` also copies the cube into the sharpest level of the specular map.

#import bevy_mirrorball::environment_map::cubemap::{
    FaceTexel, face_position, face_vector, relative_angle, texels_at_corner,
}
#import bevy_mirrorball::prefilter::padded_faces::{
    edge_without_padding, is_own_texel, is_padding_corner, padded_place, padded_texel, padded_uv,
}

@group(0) @binding(0) var finer: texture_2d_array<f32>;
@group(0) @binding(1) var coarser: texture_storage_2d_array<rgba16float, write>;
@group(0) @binding(2) var face_sampler: sampler;
/// Sharpest level of the specular map.
@group(0) @binding(3) var specular: texture_storage_2d_array<rgba16float, write>;

/// Mean of four texels, weighted by solid angle: a texel of the first level, which is half as wide as the cube. In the
/// corners of the padding it is the mean of the three texels that meet there.
fn halved(face: u32, padded: vec2u) -> vec3f {
    let edge = textureDimensions(finer).x / 2u;
    let place = padded_place(face, padded, edge);
    let is_corner = is_padding_corner(padded, edge);
    let first = vec2i((place.position * 0.5 + 0.5) * f32(edge)) * 2;
    let at_corner = texels_at_corner(face_vector(face, place.position), i32(2u * edge));
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        var found = FaceTexel(place.face, first + vec2i(vec2u(i & 1u, i >> 1u)));
        found.face = select(found.face, at_corner[min(i, 2u)].face, is_corner);
        found.texel = select(found.texel, at_corner[min(i, 2u)].texel, is_corner);
        let weight = select(relative_angle(face_position(vec2u(found.texel), 2u * edge)), f32(i < 3u), is_corner);
        let radiance = textureLoad(finer, found.texel, found.face, 0).rgb;
#ifdef COPIES
        // Roughness 0 of the specular map, where that is as large as the cube. Each texel is read once for both.
        if is_own_texel(padded, edge) {
            textureStore(specular, found.texel, found.face, vec4f(radiance, 1.0));
        }
#endif
        sum += radiance * weight;
        weight_sum += weight;
    }
    return sum / weight_sum;
}

/// First level of the pyramid.
@compute @workgroup_size(64, 1, 1)
fn halve(@builtin(global_invocation_id) id: vec3u) {
    let texel = padded_texel(id.x, textureDimensions(coarser).x);
    if texel.y >= textureDimensions(coarser).y {
        return;
    }
    textureStore(coarser, texel, id.z, vec4f(halved(id.z, texel), 1.0));
}

/// Other levels of the pyramid: quadratic splines, sixteen texels of the finer level with the weights 1 3 3 1 along
/// each axis, by four bilinear lookups. A small light then fades from texel to texel as it moves (after Manson &
/// Sloan 2016).
@compute @workgroup_size(64, 1, 1)
fn smooth_halve(@builtin(global_invocation_id) id: vec3u) {
    let padded_edge = textureDimensions(coarser).x;
    let texel = padded_texel(id.x, padded_edge);
    if texel.y >= padded_edge {
        return;
    }
    let edge = edge_without_padding(padded_edge);
    let center = padded_place(id.z, texel, edge);
    // Three quarters of a finer texel. At a corner there is nothing beyond.
    let offset = select(0.75 / f32(edge), 0.0, is_padding_corner(texel, edge));
    var sum = vec3f(0.0);
    var weight_sum = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let position = center.position + offset * (2.0 * vec2f(vec2u(i & 1u, i >> 1u)) - 1.0);
        let weight = relative_angle(position);
        let uv = padded_uv(position, textureDimensions(finer).x);
        sum += textureSampleLevel(finer, face_sampler, uv, center.face, 0.0).rgb * weight;
        weight_sum += weight;
    }
    textureStore(coarser, texel, id.z, vec4f(sum / weight_sum, 1.0));
}

/// Roughness 0 of the specular map: copy of the cube, or of the level of the pyramid that is as large.
@compute @workgroup_size(8, 8, 1)
fn sharpest(@builtin(global_invocation_id) id: vec3u) {
    let edge = textureDimensions(specular).x;
    if any(id.xy >= vec2u(edge)) {
        return;
    }
    let padding = (textureDimensions(finer).x - edge) / 2u;
    textureStore(specular, id.xy, id.z, vec4f(textureLoad(finer, id.xy + padding, id.z, 0).rgb, 1.0));
}
