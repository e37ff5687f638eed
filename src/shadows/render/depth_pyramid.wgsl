// Layout of the depth pyramids: for each tile of a key light, the depths nearest to the light in square blocks of the
// tile, at several sizes of blocks. They answer whether anything within a square of the tile may block the light, and
// miss nothing, however thin.

#define_import_path bevy_mirrorball::shadows::render::depth_pyramid

/// Blocks along an edge of the finest level. Each level has half as many as the one before.
const BLOCKS: u32 = 64u;
/// Number of levels: 64², 32², 16² and 8² blocks.
const LEVELS: u32 = 4u;
/// Number of blocks of all levels. Twin of `PYRAMID_BLOCKS` in `prepare_depth_pyramids.rs`.
const PYRAMID_BLOCKS: u32 = 5440u;

/// Blocks along an edge of a level.
fn blocks_of_level(level: u32) -> u32 {
    return BLOCKS >> level;
}

/// Number of blocks of all finer levels.
fn level_start(level: u32) -> u32 {
    let edge = blocks_of_level(level);
    return 4u * (BLOCKS * BLOCKS - edge * edge) / 3u;
}

/// Index of the first block of a key light's pyramid. `key` is the number of the key light.
fn pyramid_start(key: u32, kind: u32) -> u32 {
    return (2u * key + kind) * PYRAMID_BLOCKS;
}
