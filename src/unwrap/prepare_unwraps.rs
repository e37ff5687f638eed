//! The dispatches of one frame: sources that have changed, with their bind groups.

use super::{
    extract::{ExtractedSource, ExtractedSources},
    fading::Fading,
    history::History,
    source_buffers::SourceBuffers,
    unwrap_pipeline::{UnwrapPipelineKey, UnwrapPipelines},
};
use crate::environment_map::CubeWrites;
use bevy::{
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{BindGroup, PipelineCache, Texture},
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Dispatches of this frame, and what they need.
#[derive(Resource, Default)]
pub(super) struct PreparedUnwraps {
    pub(super) due: Vec<(UnwrapPipelineKey, BindGroup)>,
    pub(super) cube: Option<Texture>,
    pub(super) history: Option<History>,
    sources: HashMap<Entity, SourceBuffers>,
    fading: Fading,
}

impl PreparedUnwraps {
    /// Whether a source shows something else than when the cube was last made from it.
    fn is_new(&self, source: &ExtractedSource) -> bool {
        let made_from = self.sources.get(&source.entity).and_then(|known| known.made_from.as_ref());
        made_from.is_none_or(|(sequence, view)| *sequence != source.sequence || *view != source.view)
    }
}

pub(super) fn prepare_unwraps(
    mut prepared: ResMut<PreparedUnwraps>,
    mut writes: ResMut<CubeWrites>,
    extracted: Res<ExtractedSources>,
    pipelines: Res<UnwrapPipelines>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let prepared = &mut *prepared;
    prepared.due.clear();
    prepared.sources.retain(|entity, _| extracted.sources.iter().any(|source| source.entity == *entity));
    let Some((cube_id, cube)) = extracted.cube.and_then(|id| Some((id, images.get(id)?))) else {
        return;
    };
    if prepared.history.as_ref().is_none_or(|history| history.cube != cube_id) {
        prepared.history = Some(History::new(&device, cube_id));
        prepared.sources.clear();
    }
    let is_ready = |source: &&ExtractedSource| {
        let pipeline = pipelines.id(source.view.key()).and_then(|id| pipeline_cache.get_compute_pipeline(id));
        pipeline.is_some() && images.get(source.frame).is_some()
    };
    let ready: Vec<&ExtractedSource> = extracted.sources.iter().filter(is_ready).collect();
    let has_measured = ready.iter().any(|source| !source.view.is_fallback());
    let fading = prepared.fading.toward(if has_measured { extracted.measured_fraction } else { 0.0 });
    let is_fading = has_measured && fading != prepared.fading;
    if !ready.iter().any(|source| prepared.is_new(source)) && !is_fading {
        return;
    }
    let weight = prepared.fading.weight_to(fading);
    prepared.fading = fading;
    let Some(history) = &mut prepared.history else { return };
    let captured = ready.iter().map(|source| source.captured).max().unwrap_or_default();
    let mut is_first = true;
    for source in ready {
        let buffers = prepared.sources.entry(source.entity).or_default();
        let is_news = !buffers.has_frame(source.sequence);
        let mut uniform = source.view.uniform(source.scale);
        if !source.view.is_fallback() {
            uniform.weight = weight;
            if is_first {
                uniform.history_keep = history.keep(captured, if is_news { source.change } else { 0.0 });
                uniform.history_is_old = 1.0;
            }
            if !is_first || !is_news {
                uniform.history_scale = Vec3::ONE;
            }
            is_first = false;
        }
        buffers.write(uniform, &source.view, &device, &queue);
        let Some(frame) = images.get(source.frame) else { continue };
        let bind_group = buffers.bind_group([frame, cube], &history.view, &pipelines, &pipeline_cache, &device);
        let Some(bind_group) = bind_group else { continue };
        prepared.due.push((source.view.key(), bind_group));
        buffers.made_from = Some((source.sequence, source.view.clone()));
    }
    history.captured = captured;
    prepared.cube = Some(cube.texture.clone());
    writes.announce(cube_id);
}
