//! Arrangement of the shadow maps in the depth atlas.

use super::fitted_dome::FittedDome;
use bevy::{
    asset::RenderAssetUsages,
    image::{ImageCompareFunction, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
};

/// Maximum edge of the atlas in texels. Every WebGPU device supports textures of this size.
pub(super) const MAX_ATLAS_EDGE: u32 = 8192;

/// Width and height of a key light's shadow map in tiles.
pub(super) const KEY_SPAN: u32 = 2;

/// Arrangement of the tiles, row by row: all tiles for virtual casters, then all tiles for phantoms. Below them
/// follow the larger squares of key lights, in the same order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct AtlasLayout {
    pub directions: u32,
    pub keys: u32,
    pub resolution: u32,
    pub columns: u32,
    pub rows: u32,
}

impl AtlasLayout {
    /// Returns a layout whose tiles have at most the given resolution, in a texture with at most the given edge.
    pub(super) fn new(directions: u32, keys: u32, resolution: u32, max_edge: u32) -> Self {
        let tiles = 2 * directions;
        let columns = ((tiles + 2 * keys * KEY_SPAN * KEY_SPAN) as f32).sqrt().ceil().max(KEY_SPAN as f32) as u32;
        let rows = tiles.div_ceil(columns) + KEY_SPAN * (2 * keys).div_ceil(columns / KEY_SPAN);
        let mut resolution = resolution;
        while resolution > 1 && columns.max(rows) * resolution > max_edge {
            resolution /= 2;
        }
        Self { directions, keys, resolution, columns, rows }
    }

    /// Returns whether there is a tile for every shadow map of a dome.
    pub(super) fn fits(&self, dome: &FittedDome) -> bool {
        (self.directions, self.keys) == (dome.direction_count(), dome.keys.len() as u32)
    }

    /// Returns the number of shadow maps: those of directions, then those of key lights.
    pub(super) fn shadow_maps(&self) -> u32 {
        self.directions + self.keys
    }

    /// Returns the corners, in tiles, of a direction's or key light's tiles for virtual casters and for phantoms.
    pub(super) fn corners(&self, index: u32) -> [UVec2; 2] {
        let first_row = (2 * self.directions).div_ceil(self.columns);
        [0, 1].map(|kind| match index.checked_sub(self.directions) {
            None => {
                let tile = kind * self.directions + index;
                UVec2::new(tile % self.columns, tile / self.columns)
            }
            Some(key) => {
                let (place, in_row) = (kind * self.keys + key, self.columns / KEY_SPAN);
                UVec2::new(KEY_SPAN * (place % in_row), first_row + KEY_SPAN * (place / in_row))
            }
        })
    }

    /// Returns the edge of the tile of a direction or key light in texels.
    pub(super) fn tile_edge(&self, index: u32) -> u32 {
        if index < self.directions { self.resolution } else { KEY_SPAN * self.resolution }
    }

    pub(super) fn image(&self) -> Image {
        let extent = Extent3d {
            width: self.columns * self.resolution,
            height: self.rows * self.resolution,
            depth_or_array_layers: 1,
        };
        let format = TextureFormat::Depth32Float;
        let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
        image.texture_descriptor.label = Some("mirrorball_shadows_atlas");
        image.texture_descriptor.usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING;
        image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
            mag_filter: ImageFilterMode::Linear,
            min_filter: ImageFilterMode::Linear,
            compare: Some(ImageCompareFunction::GreaterEqual),
            ..default()
        });
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_tiles_overlap_and_the_atlas_fits() {
        let sizes = [(1, 0), (1, 1), (2, 8), (7, 3), (64, 2), (256, 0), (1024, 8)];
        for ((directions, keys), max_edge) in sizes.into_iter().flat_map(|size| [(size, 2048), (size, MAX_ATLAS_EDGE)])
        {
            let layout = AtlasLayout::new(directions, keys, 1024, max_edge);
            assert!(layout.columns.max(layout.rows) * layout.resolution <= max_edge);
            let mut taken = vec![false; (layout.columns * layout.rows) as usize];
            for index in 0..layout.shadow_maps() {
                let span = layout.tile_edge(index) / layout.resolution;
                for corner in layout.corners(index) {
                    for i in 0..span * span {
                        let tile = corner + UVec2::new(i % span, i / span);
                        assert!(tile.x < layout.columns && tile.y < layout.rows, "{layout:?}: {tile}");
                        let place = &mut taken[(tile.y * layout.columns + tile.x) as usize];
                        assert!(!std::mem::replace(place, true), "{layout:?}: {tile} is taken twice");
                    }
                }
            }
        }
        assert_eq!(AtlasLayout::new(64, 0, 256, MAX_ATLAS_EDGE).resolution, 256);
        assert_eq!(AtlasLayout::new(64, 0, 256, 2048).resolution, 128);
    }
}
