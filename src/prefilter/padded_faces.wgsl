// Padded faces: faces of a cube with the neighbors' texels around, so that two-dimensional lookups need not know of edges.

#define_import_path bevy_mirrorball::prefilter::padded_faces

#import bevy_mirrorball::environment_map::cubemap::{FacePlace, face_position, texel_across_edge}

/// Texels of padding on each side.
const PADDING: u32 = 1u;

/// What a texel of a padded face shows: a place on a face or, beyond an edge, on its neighbor; at the corners the corner itself,
/// which all three faces see alike.
fn padded_place(face: u32, padded: vec2u, edge: u32) -> FacePlace {
    let texel = vec2i(padded) - i32(PADDING);
    let corner = select(vec2f(-1.0), vec2f(1.0), texel > vec2i(0));
    let found = texel_across_edge(face, texel, i32(edge));
    if is_padding_corner(padded, edge) {
        return FacePlace(face, corner);
    }
    return FacePlace(found.face, face_position(vec2u(found.texel), edge));
}

fn is_padding_corner(padded: vec2u, edge: u32) -> bool {
    return all((padded < vec2u(PADDING)) | (padded >= vec2u(edge + PADDING)));
}

/// Texel of a thread, where threads run row by row through a padded face: squares of them would mostly lie beside small ones.
fn padded_texel(thread: u32, padded_edge: u32) -> vec2u {
    return vec2u(thread % padded_edge, thread / padded_edge);
}

/// Whether a texel of a padded face is one of its own.
fn is_own_texel(padded: vec2u, edge: u32) -> bool {
    return all(padded >= vec2u(PADDING)) && all(padded < vec2u(edge + PADDING));
}

/// Texture coordinates of a position on a face that is this many texels wide with its padding.
fn padded_uv(position: vec2f, padded_edge: u32) -> vec2f {
    let edge = f32(padded_edge);
    return position * (0.5 * (edge - 2.0 * f32(PADDING)) / edge) + 0.5;
}

/// Edge of a face without padding. Cubes that are worked on have a power of two, so all else is padded.
fn edge_without_padding(edge: u32) -> u32 {
    return select(edge - 2u * PADDING, edge, (edge & (edge - 1u)) == 0u);
}
