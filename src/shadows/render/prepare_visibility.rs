//! The dome's bindings, the steps and the intermediate texture of the visibility pass.

use super::{
    extract::ExtractedDome,
    gpu::{Gpu, GpuAssets},
    visibility_pipeline::{PARTIAL_SUMS_FORMAT, Step, VisibilityPipelines},
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
            BindGroup, BindGroupEntries, BindGroupLayout, CachedComputePipelineId, Extent3d, TextureDescriptor,
            TextureDimension, TextureUsages, TextureView, TextureViewDescriptor, TextureViewId,
        },
        renderer::RenderDevice,
    },
};

/// What the visibility pass needs, remade when its sources change.
#[derive(Resource, Default)]
pub(super) struct PreparedVisibility {
    pub(super) dome_bind_group: Option<BindGroup>,
    made_from: Option<(TextureViewId, AssetId<Image>)>,
    pub(super) steps: Vec<PreparedStep>,
    /// Texture between the two steps of interleaved samples, and its size.
    pub(super) partial_sums: Option<(Extent3d, TextureView)>,
}

/// A step with its pipeline and the layout of its own bindings.
pub(super) struct PreparedStep {
    pub(super) step: Step,
    pub(super) pipeline: CachedComputePipelineId,
    pub(super) layout: BindGroupLayout,
}

/// Returns the number of samples across and down.
pub(super) fn samples_extent(textures: &DomeTextures) -> Extent3d {
    let UVec2 { x: width, y: height } = textures.visibility_size;
    Extent3d { width, height, depth_or_array_layers: 1 }
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
    let (Some(textures), Some(msaa)) = (textures, cameras.iter().next()) else {
        return;
    };
    let (Some(atlas), Some(views), Some(results)) = (
        assets.images.get(&textures.atlas),
        assets.buffers.get(&textures.views),
        assets.buffers.get(&textures.results),
    ) else {
        return;
    };
    let is_multisampled = msaa.samples() > 1;
    if dome.fitted.direction_count() > 0 {
        for &step in Step::of(dome.fitted.samples) {
            let (pipeline, layout) = pipelines.pipeline(textures.shader, is_multisampled, step, &gpu.pipeline_cache);
            prepared.steps.push(PreparedStep { step, pipeline, layout });
        }
    }
    let size = samples_extent(&textures);
    if dome.fitted.samples != VisibilitySamples::Interleaved {
        prepared.partial_sums = None;
    } else if prepared.partial_sums.as_ref().is_none_or(|(old_size, _)| *old_size != size) {
        prepared.partial_sums = Some((size, partial_sums_texture(size, &gpu.device)));
    }
    let made_from = Some((atlas.texture_view.id(), textures.atlas.id()));
    if prepared.dome_bind_group.is_some() && prepared.made_from == made_from {
        return;
    }
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

fn partial_sums_texture(size: Extent3d, device: &RenderDevice) -> TextureView {
    let texture = device.create_texture(&TextureDescriptor {
        label: Some("mirrorball_shadows_tallies"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: PARTIAL_SUMS_FORMAT,
        usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&TextureViewDescriptor::default())
}
