//! Cube textures that the GPU writes.

use bevy::{
    asset::RenderAssetUsages,
    image::{ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    prelude::*,
    render::render_resource::{
        Extent3d, Texture, TextureDimension, TextureFormat, TextureUsages, TextureView, TextureViewDescriptor,
        TextureViewDimension,
    },
};

/// Uninitialized cube of 16-bit floats, bound as a cube for reading and as an array of six layers for writing. Its
/// sampler interpolates between texels and levels, because Bevy reads all maps of a view through the sampler of one
/// of them.
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

/// View of all levels of a cube as an array of six layers, for passes that read or write it.
pub(crate) fn cube_faces(texture: &Texture) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        label: Some("mirrorball_cube_faces"),
        dimension: Some(TextureViewDimension::D2Array),
        ..default()
    })
}
