//! Texture views of cubes, and padded faces.

use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindingResource, Extent3d, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureUsages,
            TextureView, TextureViewDescriptor, TextureViewDimension,
        },
        renderer::RenderDevice,
    },
};

/// Texels of padding on each side of a padded face. Mirror of `PADDING` in `padded_faces.wgsl`.
const PADDING: u32 = 1;

/// Binding of a texture view.
pub(super) fn bound(view: &TextureView) -> BindingResource<'_> {
    BindingResource::TextureView(view)
}

/// One mip level of a cube as an array of six layers.
pub(super) fn level_view(texture: &Texture, level: u32) -> TextureView {
    single_level(texture, level, TextureViewDimension::D2Array)
}

/// One mip level of a texture.
pub(super) fn single_level(texture: &Texture, level: u32, dimension: TextureViewDimension) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        label: Some("mirrorball_environment_level"),
        dimension: Some(dimension),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..default()
    })
}

/// Texture of six faces, `edge` texels wide plus one texel of their neighbors on each side.
pub(super) fn padded_faces(device: &RenderDevice, label: &'static str, edge: u32) -> Texture {
    let padded = edge + 2 * PADDING;
    device.create_texture(&TextureDescriptor {
        label: Some(label),
        size: Extent3d { width: padded, height: padded, depth_or_array_layers: 6 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba16Float,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::STORAGE_BINDING,
        view_formats: &[],
    })
}
