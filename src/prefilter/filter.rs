//! What is done for each environment: made once, and kept as long as its textures live.

use super::{
    FilteredEnvironment, filter_maker::FilterMaker, pipeline::FilterPipelines, refresh::Progress, source::SourceShape,
};
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        Extract,
        render_asset::RenderAssets,
        render_resource::{BindGroup, Buffer, CachedComputePipelineId, PipelineCache, Texture, TextureViewId},
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

#[derive(Resource, Default)]
pub(super) struct ExtractedEnvironments(Vec<FilteredEnvironment>);

pub(super) fn extract_environments(
    mut extracted: ResMut<ExtractedEnvironments>,
    environments: Extract<Query<&FilteredEnvironment>>,
) {
    extracted.0.clear();
    extracted.0.extend(environments.iter().cloned());
}

/// One dispatch: pipeline, bindings, workgroups.
pub(super) struct Dispatch {
    pub(super) pipeline: CachedComputePipelineId,
    pub(super) bind_group: BindGroup,
    pub(super) groups: UVec3,
}

/// Everything to filter one environment; made once and kept as long as its textures live.
pub(super) struct Filter {
    pub(super) made_from: TextureViewId,
    pub(super) source: AssetId<Image>,
    pub(super) dispatches: Vec<Dispatch>,
    /// What `FilteredEnvironment::viewpoint` was when its buffer was written.
    pub(super) viewpoint: Option<(Vec4, Buffer)>,
    /// The first of them, up to here, read the source and belong together.
    pub(super) capture: usize,
    /// Dispatches per frame.
    pub(super) budget: usize,
    /// Draft and finished map, copied when a set is complete.
    pub(super) publish: Vec<(Texture, Texture)>,
    pub(super) progress: Progress,
    /// The dispatch the current set has come to; 0 between sets.
    pub(super) next: usize,
    /// Request that the last set answered, and what had been written to the source then.
    pub(super) answered: Option<(u32, u32)>,
}

impl Filter {
    fn move_viewpoint(&mut self, to: Option<Vec4>, queue: &RenderQueue) {
        if let (Some((viewpoint, buffer)), Some(to)) = (&mut self.viewpoint, to)
            && *viewpoint != to
        {
            *viewpoint = to;
            let mut bytes = [0; 16];
            bytes.chunks_exact_mut(4).zip(to.to_array()).for_each(|(bytes, v)| bytes.copy_from_slice(&v.to_le_bytes()));
            queue.write_buffer(buffer, 0, &bytes);
        }
    }
}

#[derive(Resource, Default)]
pub(super) struct PreparedFilters(pub(super) HashMap<AssetId<Image>, Filter>);

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
        if let Some(filter) = existing
            && filter.made_from == source.texture_view.id()
        {
            filter.move_viewpoint(environment.viewpoint, &queue);
            continue;
        }
        let size = source.texture.size();
        let is_expected = match environment.shape {
            SourceShape::Cube(edge) => (edge, edge, 6),
            SourceShape::Equirect(width) => (width, width / 2, 1),
        } == (size.width, size.height, size.depth_or_array_layers);
        if !is_expected {
            // It has just been resized; the maps follow.
            filters.0.remove(&environment.diffuse.id());
            continue;
        }
        let maker = FilterMaker { pipelines: &pipelines, cache: &pipeline_cache, device: &device, queue: &queue };
        if let Some(filter) = maker.make(environment, source, &images) {
            filters.0.insert(environment.diffuse.id(), filter);
        }
    }
}
