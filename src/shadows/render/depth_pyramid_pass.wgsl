// Shadow maps of key lights → depth pyramids. One thread per block of the finest level; a workgroup reduces its 8 × 8
// blocks to those of the coarser levels.

#import bevy_mirrorball::shadows::render::depth_pyramid::{BLOCKS, LEVELS, blocks_of_level, level_start}
#import bevy_mirrorball::shadows::render::dome::DomeResults

/// Mirror of `PyramidTile` in `depth_pyramid_pipeline.rs`.
struct PyramidTile {
    /// The tile's first texel in the atlas.
    corner: vec2u,
    /// Width of the tile in texels.
    edge: u32,
    /// Index of the pyramid's first block.
    first_block: u32,
}

@group(0) @binding(0) var atlas: texture_depth_2d;
@group(0) @binding(1) var<storage, read> tiles: array<PyramidTile>;
@group(0) @binding(2) var<storage, read_write> results: DomeResults;

const GROUP_EDGE: u32 = 8u;
var<workgroup> nearest: array<f32, 64>;

/// Depth nearest to the light in a block of the finest level. Where blocks are no whole number of texels wide, they
/// overlap.
fn nearest_in_block(tile: PyramidTile, block: vec2u) -> f32 {
    let low = block * tile.edge / BLOCKS;
    let high = max(((block + 1u) * tile.edge + BLOCKS - 1u) / BLOCKS, low + 1u);
    var found = 0.0;
    for (var y = low.y; y < high.y; y++) {
        for (var x = low.x; x < high.x; x++) {
            found = max(found, textureLoad(atlas, vec2i(tile.corner + vec2u(x, y)), 0));
        }
    }
    return found;
}

@compute @workgroup_size(GROUP_EDGE, GROUP_EDGE)
fn reduce(
    @builtin(global_invocation_id) id: vec3u,
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_id) local: vec3u,
) {
    let tile = tiles[group.z];
    let own = local.y * GROUP_EDGE + local.x;
    let found = nearest_in_block(tile, id.xy);
    nearest[own] = found;
    results.pyramids[tile.first_block + id.y * BLOCKS + id.x] = found;
    for (var level = 1u; level < LEVELS; level++) {
        let step = 1u << level;
        workgroupBarrier();
        if all(local.xy % step == vec2u(0u)) {
            let half = step / 2u;
            let widest = max(
                max(nearest[own], nearest[own + half]),
                max(nearest[own + half * GROUP_EDGE], nearest[own + half * (GROUP_EDGE + 1u)]),
            );
            nearest[own] = widest;
            let at = id.xy / step;
            results.pyramids[tile.first_block + level_start(level) + at.y * blocks_of_level(level) + at.x] = widest;
        }
    }
}
