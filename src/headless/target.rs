//! Textures to render into.

use bevy::{
    asset::RenderAssetUsages,
    camera::RenderTarget,
    prelude::*,
    render::{
        render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
        renderer::RenderDevice,
    },
};

/// Longest side in pixels that a texture of the app's device can have; `None` without a renderer. A larger
/// [target](add_target) would end the app.
pub fn max_texture_edge(app: &App) -> Option<u32> {
    app.world().get_resource::<RenderDevice>().map(|device| device.limits().max_texture_dimension_2d)
}

/// Adds a texture to render into (8-bit sRGB) and returns it with the component that points a camera at it.
pub fn add_target(app: &mut App, size: UVec2) -> (Handle<Image>, RenderTarget) {
    let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
    let format = TextureFormat::Rgba8UnormSrgb;
    let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
    image.texture_descriptor.label = Some("mirrorball_offscreen_target");
    image.texture_descriptor.usage =
        TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_SRC;
    let handle = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    (handle.clone(), RenderTarget::Image(handle.into()))
}
