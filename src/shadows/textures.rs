//! The depth atlas and the buffers that materials read.

use super::{DomeShader, FittedDome, ShadowDomeLight, WEIGHT_BYTES, camera::visibility_buffer};
use bevy::{
    asset::RenderAssetUsages,
    image::{ImageCompareFunction, ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    prelude::*,
    render::{
        extract_resource::ExtractResource,
        render_resource::{BufferUsages, Extent3d, TextureDimension, TextureFormat, TextureUsages},
        renderer::RenderDevice,
        storage::ShaderBuffer,
    },
};

/// Largest edge of the atlas, if the device can do that; every WebGPU device can.
const MAX_ATLAS_EDGE: u32 = 8192;

/// Where materials and the visibility pass bind the atlas, its sampler, the views and the weights.
pub(super) const SHADOW_BINDINGS: [u32; 4] = [100, 101, 102, 103];

/// What materials have to follow: they are made anew when it changes.
pub(crate) type DomeIdentity = (AssetId<Image>, AssetId<ShaderBuffer>, DomeShader);

/// What materials bind to find out which share of the light arrives at a point; see `visibility.wgsl`.
///
/// The handles change only with the dome's settings. All contents are written on the GPU side.
#[derive(Resource, ExtractResource, Clone, Debug)]
pub struct DomeTextures {
    /// Depth atlas, 32-bit float, reversed depth (1 is nearest to the light, 0 nothing), with a comparison sampler.
    pub atlas: Handle<Image>,
    /// The views of all directions (`Dome` in dome.wgsl).
    pub views: Handle<ShaderBuffer>,
    /// Radiance × solid angle of every direction in linear camera units (`DomeWeight` in dome.wgsl): those with shadow maps,
    /// key lights, those without, then `L_p`.
    pub weights: Handle<ShaderBuffer>,
    /// What the visibility pass has seen, row by row, four 16-bit floats each: red, green and blue share of the light that arrives,
    /// and 1. A buffer, since the textures of Bevy's materials and of this crate would not fit WebGPU's limit of 16.
    pub visibility: Handle<ShaderBuffer>,
    pub(super) visibility_size: UVec2,
    pub(crate) shader: DomeShader,
    pub(super) layout: AtlasLayout,
}

impl FromWorld for DomeTextures {
    fn from_world(world: &mut World) -> Self {
        let layout = AtlasLayout::new(1, 0, 1, MAX_ATLAS_EDGE);
        let mut images = world.resource_mut::<Assets<Image>>();
        let atlas = images.add(layout.image());
        let visibility_size = UVec2::ONE;
        let mut buffers = world.resource_mut::<Assets<ShaderBuffer>>();
        let most = (2 * ShadowDomeLight::MAX_DIRECTIONS + ShadowDomeLight::MAX_KEY_LIGHTS) as usize;
        let mut buffer = |size| {
            let mut buffer = ShaderBuffer::new(&vec![0; size], RenderAssetUsages::RENDER_WORLD);
            buffer.buffer_description.usage |= BufferUsages::COPY_SRC;
            buffers.add(buffer)
        };
        let (views, weights) = (buffer(VIEWS_HEADER + VIEW_BYTES * most), buffer(WEIGHT_BYTES * (most + 1)));
        Self {
            atlas,
            views,
            weights,
            visibility: buffers.add(visibility_buffer(visibility_size)),
            visibility_size,
            shader: DomeShader::default(),
            layout,
        }
    }
}

impl DomeTextures {
    pub(crate) fn identity(&self) -> DomeIdentity {
        (self.atlas.id(), self.visibility.id(), self.shader)
    }
}

/// Bytes of `Dome` in dome.wgsl before its views.
pub(super) const VIEWS_HEADER: usize = 4 * 16 + 64;
/// Bytes of `DomeView` in dome.wgsl.
const VIEW_BYTES: usize = 48;

/// Tiles that a key light's shadow map takes up in width and height.
pub(super) const KEY_SPAN: u32 = 2;

/// Arrangement of the tiles, row by row: all that see virtual casters, then all that see phantoms. Below them, in larger
/// squares, those of key lights in the same order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct AtlasLayout {
    pub directions: u32,
    pub keys: u32,
    pub resolution: u32,
    pub columns: u32,
    pub rows: u32,
}

impl AtlasLayout {
    /// With tiles of at most a resolution, in a texture of at most an edge.
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

    /// All shadow maps: those of directions, then those of key lights.
    pub(super) fn shadow_maps(&self) -> u32 {
        self.directions + self.keys
    }

    /// Where in the atlas, in tiles, a direction or key light has the tiles for virtual casters and for phantoms.
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

    /// Texels along the edge of the tile of a direction or key light.
    pub(super) fn tile_edge(&self, index: u32) -> u32 {
        if index < self.directions { self.resolution } else { KEY_SPAN * self.resolution }
    }

    fn image(&self) -> Image {
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

pub(super) fn fit_textures(
    mut textures: ResMut<DomeTextures>,
    mut images: ResMut<Assets<Image>>,
    domes: Query<&ShadowDomeLight>,
    fitted: Res<FittedDome>,
    device: Res<RenderDevice>,
) {
    let Some(dome) = domes.iter().next() else {
        return;
    };
    let (directions, keys) = (fitted.direction_count(), fitted.keys.len() as u32);
    if directions == 0 {
        return;
    }
    let max_edge = device.limits().max_texture_dimension_2d.min(MAX_ATLAS_EDGE);
    let layout = AtlasLayout::new(directions, keys, dome.resolution.clamp(32, 1024), max_edge);
    let has_lenses = keys > 0 || fitted.file_views.iter().any(|view| view.lens.is_some());
    textures.shader = DomeShader { filter: dome.filter.kind(), has_keys: keys > 0, has_lenses };
    if textures.layout != layout {
        textures.atlas = images.add(layout.image());
        textures.layout = layout;
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
