// Faces of cube maps: directions of positions on a face and back, and lookups across edges. Twin of `cubemap.rs`.
//
// Cubes are read face by face, as layers of an array, because drivers' own lookups differ too much at the edges of
// faces (some do not interpolate across them at all). Directions are in the left-handed frame of a cube, whose +z is
// the world's −Z. Faces lie as in Vulkan 1.3, 16.5.4 "Cube Map Face Selection".

#define_import_path bevy_mirrorball::environment_map::cubemap

/// Face, and position on it, −1…1 across and down.
struct FacePlace {
    face: u32,
    position: vec2f,
}

/// Face, and texel of it.
struct FaceTexel {
    face: u32,
    texel: vec2i,
}

/// Vector (cube frame) to a position on a face of the cube −1…1. Selects instead of a switch, all cases of which
/// software Vulkan executes.
fn face_vector(face: u32, p: vec2f) -> vec3f {
    let sign = select(1.0, -1.0, (face & 1u) == 1u);
    let is_x = face < 2u;
    let is_y = (face & 2u) == 2u;
    return vec3f(
        select(select(sign * p.x, p.x, is_y), sign, is_x),
        select(-p.y, sign, is_y),
        select(select(sign, sign * p.y, is_y), -sign * p.x, is_x),
    );
}

/// Unit vector (cube frame) to a position on a face.
fn face_direction(face: u32, p: vec2f) -> vec3f {
    return normalize(face_vector(face, p));
}

/// Position of the center of a texel.
fn face_position(texel: vec2u, edge: u32) -> vec2f {
    return (2.0 * vec2f(texel) + 1.0) / f32(edge) - 1.0;
}

/// Solid angle per area of the face −1…1 at a position.
fn relative_angle(p: vec2f) -> f32 {
    let inverse = inverseSqrt(1.0 + dot(p, p));
    return inverse * inverse * inverse;
}

/// Place where a direction (cube frame, of any length) meets the cube.
fn place_of(dir: vec3f) -> FacePlace {
    let size = abs(dir);
    let is_z = size.z >= max(size.x, size.y);
    let is_y = !is_z && size.y >= size.x;
    let is_x = !is_z && !is_y;
    let along = select(select(dir.x, dir.y, is_y), dir.z, is_z);
    let sign = select(1.0, -1.0, along < 0.0);
    // To the right: −z, x, x on the positive faces of x, y, z; down: −y, z, −y.
    let right = select(select(sign * dir.x, dir.x, is_y), -sign * dir.z, is_x);
    let down = select(-dir.y, sign * dir.z, is_y);
    let face = select(select(0u, 2u, is_y), 4u, is_z) + u32(along < 0.0);
    return FacePlace(face, vec2f(right, down) / max(abs(along), 1e-30));
}

/// Texel at an index that may lie one step beyond an edge of its face: there it is the neighbor's.
fn texel_across_edge(face: u32, texel: vec2i, edge: i32) -> FaceTexel {
    let place = place_of(face_vector(face, (2.0 * vec2f(texel) + 1.0) / f32(edge) - 1.0));
    // The place is less than half a texel off the center of the neighbor's texel.
    let at = vec2i((place.position * 0.5 + 0.5) * f32(edge));
    return FaceTexel(place.face, clamp(at, vec2i(0), vec2i(edge - 1)));
}

/// Texels of the three faces that meet at a corner of the cube −1…1.
fn texels_at_corner(corner: vec3f, edge: i32) -> array<FaceTexel, 3> {
    let faces = vec3u(0u, 2u, 4u) + select(vec3u(0u), vec3u(1u), corner < vec3f(0.0));
    let right = vec3f(-corner.x * corner.z, corner.x, corner.x * corner.z);
    let down = vec3f(-corner.y, corner.y * corner.z, -corner.y);
    let column = select(vec3i(0), vec3i(edge - 1), right > vec3f(0.0));
    let row = select(vec3i(0), vec3i(edge - 1), down > vec3f(0.0));
    return array(
        FaceTexel(faces.x, vec2i(column.x, row.x)),
        FaceTexel(faces.y, vec2i(column.y, row.y)),
        FaceTexel(faces.z, vec2i(column.z, row.z)),
    );
}

/// Bilinear lookup in one mip level of a cube, across edges. Where three faces meet, the missing fourth texel is the
/// mean of the other three.
fn sample_faces(faces: texture_2d_array<f32>, dir: vec3f, level: u32) -> vec4f {
    let edge = i32(textureDimensions(faces, level).x);
    let place = place_of(dir);
    let at = (place.position * 0.5 + 0.5) * f32(edge) - 0.5;
    let low = floor(at);
    let t = at - low;
    var values = array<vec4f, 4>();
    var sum = vec4f(0.0);
    for (var i = 0; i < 4; i++) {
        let found = texel_across_edge(place.face, vec2i(low) + vec2i(i & 1, i >> 1u), edge);
        values[i] = textureLoad(faces, found.texel, found.face, level);
        sum += values[i];
    }
    // −1 or 1 where the lookup reaches beyond an edge.
    let beyond = select(vec2i(0), vec2i(-1), low < vec2f(0.0))
        + select(vec2i(0), vec2i(1), vec2i(low) + 1 >= vec2i(edge));
    let missing = select(0, 1, beyond.x > 0) + select(0, 2, beyond.y > 0);
    for (var i = 0; i < 4; i++) {
        values[i] = select(values[i], (sum - values[i]) / 3.0, all(beyond != vec2i(0)) && i == missing);
    }
    return mix(mix(values[0], values[1], t.x), mix(values[2], values[3], t.x), t.y);
}
