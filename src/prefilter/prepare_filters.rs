//! One filter plan per environment, kept as long as its textures live.

use super::{
    dispatch::DispatchBuilder, extract::ExtractedEnvironments, filter_pipeline::FilterPipelines,
    filter_plan::FilterPlan, source::SourceShape,
};
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::PipelineCache,
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Plans by diffuse map, which environments with the same source share.
#[derive(Resource, Default)]
pub(super) struct PreparedFilters(pub(super) HashMap<AssetId<Image>, FilterPlan>);

pub(super) fn prepare_filters(
    mut filters: ResMut<PreparedFilters>,
    environments: Res<ExtractedEnvironments>,
    pipelines: Res<FilterPipelines>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    filters.0.retain(|diffuse, _| environments.0.iter().any(|environment| environment.diffuse.id() == *diffuse));
    for environment in &environments.0 {
        let Some(source) = images.get(&environment.source) else {
            continue;
        };
        let existing = filters.0.get_mut(&environment.diffuse.id());
        if let Some(plan) = existing
            && plan.made_from == source.texture_view.id()
        {
            plan.move_viewpoint(environment.viewpoint, &queue);
            continue;
        }
        let size = source.texture.size();
        let is_expected = match environment.shape {
            SourceShape::Cube(edge) => (edge, edge, 6),
            SourceShape::Equirect(width) => (width, width / 2, 1),
        } == (size.width, size.height, size.depth_or_array_layers);
        if !is_expected {
            // The source has just been resized; its maps follow.
            filters.0.remove(&environment.diffuse.id());
            continue;
        }
        let builder = DispatchBuilder { pipelines: &pipelines, cache: &pipeline_cache, device: &device, queue: &queue };
        if let Some(plan) = FilterPlan::new(&builder, environment, source, &images) {
            filters.0.insert(environment.diffuse.id(), plan);
        }
    }
}
