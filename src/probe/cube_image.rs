//! Cube maps that the GPU writes.

use bevy::{
    asset::RenderAssetUsages,
    image::{ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{
        Extent3d, TextureDimension, TextureFormat, TextureUsages, TextureViewDescriptor, TextureViewDimension,
    },
};

/// A cube of 16-bit floats without contents: bound as a cube for reading and as an array of six layers for writing, with
/// filtering between texels and levels (Bevy reads all maps of a view through one map's sampler).
pub(crate) fn cube_image(label: &'static str, edge: u32, levels: u32) -> Image {
    let extent = Extent3d { width: edge, height: edge, depth_or_array_layers: 6 };
    let format = TextureFormat::Rgba16Float;
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::all());
    image.texture_descriptor.label = Some(label);
    image.texture_descriptor.mip_level_count = levels;
    image.texture_descriptor.usage =
        TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING | TextureUsages::COPY_SRC;
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
        mag_filter: ImageFilterMode::Linear,
        min_filter: ImageFilterMode::Linear,
        mipmap_filter: ImageFilterMode::Linear,
        ..default()
    });
    image
}

/// Render world: what passes on the GPU have written, for stages that work only when something has changed.
///
/// Announce a cube (or any other source of a [`LiveEnvironment`](crate::environment::LiveEnvironment)) before the render graph
/// runs, in the frame in which it is written.
#[derive(Resource, Default)]
pub struct CubeWrites(HashMap<AssetId<Image>, u32>);

impl CubeWrites {
    /// Says that an image is written in this frame.
    pub fn announce(&mut self, image: AssetId<Image>) {
        let count = self.0.entry(image).or_default();
        *count = count.wrapping_add(1);
    }

    /// How often an image was announced, to compare with an earlier answer.
    pub fn count(&self, image: AssetId<Image>) -> u32 {
        self.0.get(&image).copied().unwrap_or_default()
    }
}
