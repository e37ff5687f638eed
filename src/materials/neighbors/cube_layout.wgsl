// Layout of a cube with all its levels in a buffer: level after level, face after face, row after row, each face with a
// border of its neighbors' texels. Twin of `level_start` in `neighbor_cubes.rs`.

#define_import_path bevy_mirrorball::materials::neighbors::cube_layout

/// Edge length of a face with its border.
fn padded_edge(edge: u32, level: u32) -> u32 {
    return (edge >> level) + 2u;
}

/// Index of the first texel of a level.
fn level_start(edge: u32, level: u32) -> u32 {
    var start = 0u;
    for (var i = 0u; i < level; i++) {
        let padded = padded_edge(edge, i);
        start += 6u * padded * padded;
    }
    return start;
}

/// Level that holds perceptual roughness 1, whose faces have four texels along an edge.
fn last_level(edge: u32) -> u32 {
    return firstLeadingBit(max(edge, 4u)) - 2u;
}
