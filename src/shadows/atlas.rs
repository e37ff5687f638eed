//! The depth atlas and the buffers that the dome shares with materials.

use super::{
    atlas_layout::{AtlasLayout, MAX_ATLAS_EDGE},
    dome_light::ShadowDomeLight,
    filter::DomeShader,
    fitted_dome::FittedDome,
    render::PYRAMID_BLOCKS,
};
use bevy::{
    asset::RenderAssetUsages,
    prelude::*,
    render::{
        extract_resource::ExtractResource, render_resource::BufferUsages, renderer::RenderDevice, storage::ShaderBuffer,
    },
};

/// Binding indices of the atlas, its sampler, the views and the results, in materials and in the visibility pass.
pub(super) const SHADOW_BINDINGS: [u32; 4] = [100, 101, 102, 103];

/// Key of everything that materials bind. Materials are remade when it changes.
pub(crate) type DomeIdentity = (AssetId<Image>, AssetId<ShaderBuffer>, DomeShader);

/// Textures and buffers that materials bind to compute the fraction of light that arrives at a point. See
/// `render/visibility.wgsl`.
///
/// The handles change only with the dome's settings. All contents are written on the GPU.
#[derive(Resource, ExtractResource, Reflect, Clone, Debug)]
#[reflect(Resource, Debug, Clone)]
pub struct DomeTextures {
    /// Depth atlas with a comparison sampler. 32-bit float, reversed depth: 1 is nearest to the light, 0 is empty.
    pub atlas: Handle<Image>,
    /// Views of all directions (`Dome` in `dome.wgsl`).
    pub views: Handle<ShaderBuffer>,
    /// What the GPU computes for each direction (`DomeResults` in `dome.wgsl`): radiance × solid angle in linear
    /// camera units of directions with shadow maps, key lights and directions without shadow maps, then `L_p`; the
    /// surfels with the radiance that they send; and the depth pyramids of key lights.
    pub results: Handle<ShaderBuffer>,
    /// Samples of the visibility pass, row by row (`VisibilitySample` in `samples.wgsl`): the surface of the prepass,
    /// and the fraction of light that arrives in red, green and blue, and 1. At a phantom the last one is the luminance
    /// that other phantoms leave, if there are lamps. This is a buffer because the textures of Bevy's materials and of
    /// this crate together would exceed WebGPU's limit of 16.
    pub visibility: Handle<ShaderBuffer>,
    pub(super) visibility_size: UVec2,
    /// Pixels across one sample.
    pub(super) sample_pixels: u32,
    #[reflect(ignore)]
    pub(crate) shader: DomeShader,
    #[reflect(ignore)]
    pub(super) layout: AtlasLayout,
}

impl FromWorld for DomeTextures {
    fn from_world(world: &mut World) -> Self {
        let layout = AtlasLayout::new(1, 0, 1, MAX_ATLAS_EDGE);
        let mut images = world.resource_mut::<Assets<Image>>();
        let atlas = images.add(layout.image());
        let visibility_size = UVec2::ONE;
        let mut buffers = world.resource_mut::<Assets<ShaderBuffer>>();
        let mut buffer = |size| {
            let mut buffer = ShaderBuffer::new(&vec![0; size], RenderAssetUsages::RENDER_WORLD);
            buffer.buffer_description.usage |= BufferUsages::COPY_SRC;
            buffers.add(buffer)
        };
        let (views, results) = (buffer(VIEWS_HEADER_BYTES + VIEW_BYTES * MAX_VIEWS), buffer(RESULTS_BYTES));
        Self {
            atlas,
            views,
            results,
            visibility: buffers.add(visibility_buffer(visibility_size)),
            visibility_size,
            sample_pixels: 1,
            shader: DomeShader::default(),
            layout,
        }
    }
}

impl DomeTextures {
    pub(crate) fn identity(&self) -> DomeIdentity {
        (self.atlas.id(), self.visibility.id(), self.shader)
    }

    /// Returns the number of samples for a target, and the pixels across one of them. Where a device cannot bind so
    /// many samples, they are coarser.
    pub(super) fn samples_for(target: UVec2, pixels: u32, max_bytes: u64) -> (UVec2, u32) {
        let (size, bytes) = (UVec2::new(target.x.div_ceil(pixels), target.y.div_ceil(pixels)), VISIBILITY_BYTES as u64);
        if size.max_element() > 1 && u64::from(size.x) * u64::from(size.y) * bytes > max_bytes {
            return Self::samples_for(target, 2 * pixels, max_bytes);
        }
        (size, pixels)
    }

    /// Replaces the buffer of the visibility pass by one for another number of samples.
    pub(super) fn resize_visibility(&mut self, size: UVec2, buffers: &mut Assets<ShaderBuffer>) {
        self.visibility = buffers.add(visibility_buffer(size));
        self.visibility_size = size;
    }
}

/// Bytes of `Dome` in `dome.wgsl` before its views.
pub(super) const VIEWS_HEADER_BYTES: usize = 4 * 16 + 64 + 16;
/// Bytes of `DomeView` in `dome.wgsl`.
pub(super) const VIEW_BYTES: usize = 48;
/// Bytes of `DomeWeight` in `dome.wgsl`.
pub(super) const WEIGHT_BYTES: usize = 12;
/// Largest number of directions and key lights.
const MAX_VIEWS: usize = (2 * ShadowDomeLight::MAX_DIRECTIONS + ShadowDomeLight::MAX_KEY_LIGHTS) as usize;
/// Number of weights in `DomeResults`. Twin of `MAX_WEIGHTS` in `dome.wgsl`.
const MAX_WEIGHTS: usize = MAX_VIEWS + 1;
/// Offset in bytes of the surfels in `DomeResults`, and their bytes: a header, then 48 bytes each.
pub(super) const LIT_OFFSET: usize = (WEIGHT_BYTES * MAX_WEIGHTS).next_multiple_of(16);
pub(super) const LIT_BYTES: usize = 32 + 48 * ShadowDomeLight::MAX_SURFELS as usize;
/// Bytes of `DomeResults` in `dome.wgsl`: the weights, the surfels, then two pyramids per key light.
const RESULTS_BYTES: usize =
    LIT_OFFSET + LIT_BYTES + 4 * (2 * ShadowDomeLight::MAX_KEY_LIGHTS * PYRAMID_BLOCKS) as usize;
/// Bytes of `VisibilitySample` in `samples.wgsl`.
const VISIBILITY_BYTES: usize = 32;

/// Returns a buffer for the samples of the visibility pass.
fn visibility_buffer(size: UVec2) -> ShaderBuffer {
    let bytes = size.element_product() as usize * VISIBILITY_BYTES;
    ShaderBuffer::new(&vec![0; bytes], RenderAssetUsages::RENDER_WORLD)
}

/// Fits the atlas to the number of shadow maps and to the resolution of the first dome.
pub(super) fn fit_atlas(
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
    let has_perspective = fitted.file_views.iter().any(|view| view.perspective.is_some());
    // `choose_visibility_camera` decides the rest.
    let shader = DomeShader { filter: dome.filter.kind(), has_keys: keys > 0, has_perspective, ..textures.shader };
    if textures.shader != shader {
        textures.shader = shader;
    }
    if textures.layout != layout {
        textures.atlas = images.add(layout.image());
        textures.layout = layout;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_coarser_where_a_device_cannot_bind_them() {
        let limit = 128 << 20;
        let of = |width, height, pixels| DomeTextures::samples_for(UVec2::new(width, height), pixels, limit);
        assert_eq!(of(1919, 1080, 1), (UVec2::new(1919, 1080), 1));
        assert_eq!(of(1919, 1080, 2), (UVec2::new(960, 540), 2));
        assert_eq!(of(3840, 2160, 1), (UVec2::new(1920, 1080), 2), "8.3 million samples take 265 MB");
        assert_eq!(of(1, 1, 2), (UVec2::ONE, 2));
    }
}
