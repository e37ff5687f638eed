//! The dome's bindings, the steps and the buffers of the visibility pass.

use super::{
    extract::ExtractedDome,
    gpu::{Gpu, GpuAssets},
    visibility_cache::VisibilityCache,
    visibility_pipeline::{Step, VisibilityPipelines, VisibilityShader},
};
use crate::shadows::{
    atlas::{DomeTextures, SHADOW_BINDINGS},
    dome_light::VisibilitySamples,
    visibility_camera::VisibilityCamera,
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferUsages, CachedComputePipelineId, TextureViewId,
        },
        renderer::RenderDevice,
    },
};

/// Bytes of the sums of one sample over a quarter of the directions.
const PARTIAL_SUMS_BYTES: u64 = 16;

/// What the visibility pass needs, remade when its sources change.
#[derive(Resource, Default)]
pub(super) struct PreparedVisibility {
    pub(super) dome_bind_group: Option<BindGroup>,
    made_from: Option<(TextureViewId, AssetId<Image>)>,
    /// Permutation of the shader, and the steps with their pipelines. Empty if there is nothing to do.
    pub(super) shader: Option<VisibilityShader>,
    pub(super) steps: Vec<(Step, CachedComputePipelineId)>,
    /// Buffer between the two steps of interleaved samples.
    pub(super) partial_sums: Option<Buffer>,
    /// `None` where lookups are not kept.
    pub(super) cache: Option<VisibilityCache>,
}

pub(super) fn prepare_visibility(
    mut prepared: ResMut<PreparedVisibility>,
    mut pipelines: ResMut<VisibilityPipelines>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    cameras: Query<&Msaa, With<VisibilityCamera>>,
    assets: GpuAssets,
    gpu: Gpu,
) {
    prepared.steps.clear();
    let Some(textures) = textures else {
        return;
    };
    let (Some(atlas), Some(views), Some(results)) = (
        assets.images.get(&textures.atlas),
        assets.buffers.get(&textures.views),
        assets.buffers.get(&textures.results),
    ) else {
        return;
    };
    let made_from = Some((atlas.texture_view.id(), textures.atlas.id()));
    if prepared.dome_bind_group.is_none() || prepared.made_from != made_from {
        let [atlas_at, sampler_at, views_at, results_at] = SHADOW_BINDINGS;
        let entries = BindGroupEntries::with_indices((
            (atlas_at, &atlas.texture_view),
            (sampler_at, &atlas.sampler),
            (views_at, views.buffer.as_entire_binding()),
            (results_at, results.buffer.as_entire_binding()),
        ));
        let label = "mirrorball_shadows_visibility_dome_bind_group";
        prepared.dome_bind_group = Some(gpu.bind_group(label, &pipelines.dome_layout, &entries));
        prepared.made_from = made_from;
    }
    let Some(msaa) = cameras.iter().next().filter(|_| dome.fitted.direction_count() > 0) else {
        prepared.cache = None;
        return;
    };
    prepared.cache = VisibilityCache::fit(prepared.cache.take(), &dome.fitted, &textures, &gpu.device);
    let shader = VisibilityShader {
        dome: textures.shader,
        is_multisampled: msaa.samples() > 1,
        is_interleaved: dome.fitted.samples == VisibilitySamples::Interleaved,
        is_cached: prepared.cache.is_some(),
    };
    prepared.shader = Some(shader);
    prepared.steps.extend_from_slice(pipelines.steps(shader, &gpu.pipeline_cache));
    let samples = if shader.is_interleaved { textures.visibility_size.as_u64vec2().element_product() } else { 1 };
    let bytes = samples * PARTIAL_SUMS_BYTES;
    if prepared.partial_sums.as_ref().is_none_or(|buffer| buffer.size() != bytes) {
        prepared.partial_sums = Some(partial_sums_buffer(bytes, &gpu.device));
    }
}

fn partial_sums_buffer(size: u64, device: &RenderDevice) -> Buffer {
    device.create_buffer(&BufferDescriptor {
        label: Some("mirrorball_shadows_partial_sums"),
        size,
        usage: BufferUsages::STORAGE,
        mapped_at_creation: false,
    })
}
