//! Upload of camera frames to the GPU.
//!
//! Each camera owns one texture that is overwritten in place, so bind groups made from it stay valid.

use super::{CameraFrame, FramePixels};
use bevy::{
    asset::RenderAssetUsages,
    image::{ImageFilterMode, ImageSampler, ImageSamplerDescriptor},
    platform::collections::HashMap,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderSystems,
        render_asset::RenderAssets,
        render_resource::{
            Extent3d, Origin3d, TexelCopyBufferLayout, TexelCopyTextureInfo, TextureAspect, TextureDimension,
            TextureFormat, TextureUsages,
        },
        renderer::RenderQueue,
        texture::GpuImage,
    },
};
use std::sync::Arc;

/// The newest frame of a camera as a texture: 8-bit sRGB, the size of the frame, linear filtering.
///
/// The GPU queue writes it: do not change the [`Image`] asset behind it.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::camera::FrameTexture;
/// fn show(mut screens: ResMut<Assets<StandardMaterial>>, frames: Query<&FrameTexture, Added<FrameTexture>>) {
///     for frame in &frames {
///         screens.add(StandardMaterial { base_color_texture: Some(frame.image.clone()), unlit: true, ..default() });
///     }
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(Component, Debug, Clone)]
pub struct FrameTexture {
    /// The texture. Replaced only when the size of the frames changes.
    pub image: Handle<Image>,
    size: UVec2,
}

impl FrameTexture {
    /// Width and height in pixels.
    pub fn size(&self) -> UVec2 {
        self.size
    }
}

pub(super) fn build(app: &mut App) {
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<PendingFrames>()
        .add_systems(ExtractSchedule, extract_frames)
        .add_systems(Render, upload_frames.in_set(RenderSystems::PrepareResources));
}

pub(super) fn allocate_frame_textures(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    cameras: Query<(Entity, &CameraFrame, Option<&FrameTexture>), Changed<CameraFrame>>,
) {
    for (entity, frame, texture) in &cameras {
        let size = frame.pixels.size;
        if texture.is_some_and(|texture| texture.size == size) {
            continue;
        }
        let extent = Extent3d { width: size.x, height: size.y, depth_or_array_layers: 1 };
        let format = TextureFormat::Rgba8UnormSrgb;
        let mut image = Image::new_uninit(extent, TextureDimension::D2, format, RenderAssetUsages::RENDER_WORLD);
        image.texture_descriptor.label = Some("mirrorball_camera_frame");
        image.texture_descriptor.usage = TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST;
        image.sampler = ImageSampler::Descriptor(ImageSamplerDescriptor {
            mag_filter: ImageFilterMode::Linear,
            min_filter: ImageFilterMode::Linear,
            ..default()
        });
        commands.entity(entity).insert(FrameTexture { image: images.add(image), size });
    }
}

/// Frames that wait for their textures, and the number of the frame that each texture holds.
#[derive(Resource, Default)]
struct PendingFrames {
    waiting: HashMap<AssetId<Image>, (Arc<FramePixels>, u64)>,
    uploaded: HashMap<AssetId<Image>, u64>,
}

fn extract_frames(mut pending: ResMut<PendingFrames>, cameras: Extract<Query<(&CameraFrame, &FrameTexture)>>) {
    let live = |id: &AssetId<Image>| cameras.iter().any(|(_, texture)| texture.image.id() == *id);
    pending.waiting.retain(|id, _| live(id));
    pending.uploaded.retain(|id, _| live(id));
    for (frame, texture) in &cameras {
        let id = texture.image.id();
        if texture.size == frame.pixels.size && pending.uploaded.get(&id) != Some(&frame.sequence) {
            pending.waiting.insert(id, (frame.pixels.clone(), frame.sequence));
        }
    }
}

fn upload_frames(mut pending: ResMut<PendingFrames>, images: Res<RenderAssets<GpuImage>>, queue: Res<RenderQueue>) {
    let PendingFrames { waiting, uploaded } = &mut *pending;
    waiting.retain(|&id, (pixels, sequence)| {
        let Some(image) = images.get(id) else {
            return true;
        };
        let extent = Extent3d { width: pixels.size.x, height: pixels.size.y, depth_or_array_layers: 1 };
        queue.write_texture(
            TexelCopyTextureInfo {
                texture: &image.texture,
                mip_level: 0,
                origin: Origin3d::ZERO,
                aspect: TextureAspect::All,
            },
            &pixels.rgba,
            TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(4 * pixels.size.x), rows_per_image: None },
            extent,
        );
        uploaded.insert(id, *sequence);
        false
    });
}
