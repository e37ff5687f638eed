//! Chooses the depth pyramids to compute: those of the key lights whose shadow maps are drawn in this frame.

use super::{
    depth_pyramid_pipeline::{DepthPyramidPipeline, PyramidTile},
    gpu::{Gpu, GpuAssets},
    prepare_depth::PreparedDepth,
};
use crate::shadows::{atlas::DomeTextures, atlas_layout::AtlasLayout};
use bevy::{
    prelude::*,
    render::render_resource::{BindGroup, BindGroupEntries},
};

/// Number of blocks of all levels of a pyramid. Twin of `PYRAMID_BLOCKS` in `depth_pyramid.wgsl`.
pub(in crate::shadows) const PYRAMID_BLOCKS: u32 = 64 * 64 + 32 * 32 + 16 * 16 + 8 * 8;

/// What the depth pyramid pass computes in this frame.
#[derive(Resource, Default)]
pub(super) struct PreparedDepthPyramids {
    pub(super) bind_group: Option<BindGroup>,
    pub(super) tile_count: u32,
}

/// Returns the tiles of a key light: past virtual casters, then past phantoms.
fn pyramid_tiles(layout: &AtlasLayout, index: u32) -> impl Iterator<Item = PyramidTile> {
    let (edge, resolution) = (layout.tile_edge(index), layout.resolution);
    let first = 2 * (index - layout.directions);
    (0..).zip(layout.corners(index)).map(move |(kind, corner)| PyramidTile {
        corner: corner * resolution,
        edge,
        first_block: (first + kind) * PYRAMID_BLOCKS,
    })
}

pub(super) fn prepare_depth_pyramids(
    mut prepared: ResMut<PreparedDepthPyramids>,
    depth: Res<PreparedDepth>,
    textures: Option<Res<DomeTextures>>,
    pipeline: Res<DepthPyramidPipeline>,
    assets: GpuAssets,
    gpu: Gpu,
) {
    *prepared = PreparedDepthPyramids::default();
    let Some(textures) = textures.filter(|_| depth.bind_group.is_some()) else {
        return;
    };
    let keys = depth.refreshed.iter().filter(|index| **index >= textures.layout.directions);
    let tiles: Vec<_> = keys.flat_map(|index| pyramid_tiles(&textures.layout, *index)).collect();
    let (Some(atlas), Some(results), false) =
        (assets.images.get(&textures.atlas), assets.buffers.get(&textures.results), tiles.is_empty())
    else {
        return;
    };
    let tile_count = tiles.len() as u32;
    let tiles = gpu.storage_buffer("mirrorball_shadows_depth_pyramid_tiles", tiles, PyramidTile::default());
    let Some(tiles) = tiles.binding() else {
        return;
    };
    let entries = BindGroupEntries::sequential((&atlas.texture_view, tiles, results.buffer.as_entire_binding()));
    let bind_group = gpu.bind_group("mirrorball_shadows_depth_pyramid_bind_group", &pipeline.layout, &entries);
    *prepared = PreparedDepthPyramids { bind_group: Some(bind_group), tile_count };
}
