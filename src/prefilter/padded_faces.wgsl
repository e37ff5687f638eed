// Padded faces: faces of a cube with a border of their neighbors' texels, so that two-dimensional lookups work across
// edges.

#define_import_path bevy_mirrorball::prefilter::padded_faces

#import bevy_mirrorball::environment_map::cubemap::{FacePlace, face_position, texel_across_edge}

/// Texels of padding on each side. Mirror of `PADDING` in `cube_views.rs`.
const PADDING: u32 = 1u;

/// Place that a texel of a padded face shows: on its own face or, beyond an edge, on the neighbor. At the corners of
/// the padding it is the corner of the cube, which all three faces share.
fn padded_place(face: u32, padded: vec2u, edge: u32) -> FacePlace {
    let texel = vec2i(padded) - i32(PADDING);
    let corner = select(vec2f(-1.0), vec2f(1.0), texel > vec2i(0));
    let found = texel_across_edge(face, texel, i32(edge));
    if is_padding_corner(padded, edge) {
        return FacePlace(face, corner);
    }
    return FacePlace(found.face, face_position(vec2u(found.texel), edge));
}

/// Whether a texel of a padded face is a corner of the padding.
fn is_padding_corner(padded: vec2u, edge: u32) -> bool {
    return all((padded < vec2u(PADDING)) | (padded >= vec2u(edge + PADDING)));
}

/// Texel of a thread. Threads run row by row through a padded face, because square workgroups would mostly lie
/// outside of small faces.
fn padded_texel(thread: u32, padded_edge: u32) -> vec2u {
    return vec2u(thread % padded_edge, thread / padded_edge);
}

/// Whether a texel of a padded face belongs to the face itself.
fn is_own_texel(padded: vec2u, edge: u32) -> bool {
    return all(padded >= vec2u(PADDING)) && all(padded < vec2u(edge + PADDING));
}

/// Texture coordinates of a position on a face whose width with padding is `padded_edge` texels.
fn padded_uv(position: vec2f, padded_edge: u32) -> vec2f {
    let edge = f32(padded_edge);
    return position * (0.5 * (edge - 2.0 * f32(PADDING)) / edge) + 0.5;
}

/// Edge length of a face without its padding. Cubes have powers of two as edge lengths, so any other length is padded.
fn edge_without_padding(edge: u32) -> u32 {
    return select(edge - 2u * PADDING, edge, (edge & (edge - 1u)) == 0u);
}
