//! The dispatches of one frame: sources that have changed, with their bind groups.

use super::{
    extract::{CubeSources, ExtractedCubes, ExtractedSource},
    fading::Fading,
    history::History,
    source_buffers::SourceBuffers,
    unwrap_pipeline::{UnwrapPipelineKey, UnwrapPipelines},
};
use crate::environment_map::CubeWrites;
use bevy::{
    ecs::system::SystemParam,
    platform::collections::HashMap,
    prelude::*,
    render::{
        render_asset::RenderAssets,
        render_resource::{BindGroup, PipelineCache, Texture},
        renderer::{RenderDevice, RenderQueue},
        texture::GpuImage,
    },
};

/// Dispatches of this frame, and what they need, for each environment cube.
#[derive(Resource, Default)]
pub(super) struct PreparedUnwraps(pub(super) HashMap<AssetId<Image>, PreparedCube>);

/// Dispatches that write one cube, and what they need.
pub(super) struct PreparedCube {
    pub(super) due: Vec<(UnwrapPipelineKey, BindGroup)>,
    pub(super) cube: Texture,
    pub(super) history: History,
    sources: HashMap<Entity, SourceBuffers>,
    fading: Fading,
}

impl PreparedCube {
    fn new(cube: &GpuImage, device: &RenderDevice) -> Self {
        Self {
            due: Vec::new(),
            cube: cube.texture.clone(),
            history: History::new(device),
            sources: HashMap::default(),
            fading: Fading::default(),
        }
    }

    /// Whether a source shows something else than when the cube was last made from it.
    fn is_new(&self, source: &ExtractedSource) -> bool {
        let made_from = self.sources.get(&source.entity).and_then(|known| known.made_from.as_ref());
        made_from.is_none_or(|(sequence, view)| *sequence != source.sequence || *view != source.view)
    }
}

/// What dispatches are made of.
#[derive(SystemParam)]
pub(super) struct UnwrapResources<'w> {
    pipelines: Res<'w, UnwrapPipelines>,
    pipeline_cache: Res<'w, PipelineCache>,
    images: Res<'w, RenderAssets<GpuImage>>,
    device: Res<'w, RenderDevice>,
    queue: Res<'w, RenderQueue>,
}

pub(super) fn prepare_unwraps(
    mut prepared: ResMut<PreparedUnwraps>,
    mut writes: ResMut<CubeWrites>,
    extracted: Res<ExtractedCubes>,
    resources: UnwrapResources,
) {
    // What a cube has shown is kept as long as the cube, even while nothing contributes to it.
    prepared.0.retain(|cube, _| resources.images.get(*cube).is_some());
    for (cube, prepared) in &mut prepared.0 {
        let sources = extracted.0.iter().find(|extracted| extracted.cube == *cube).map(|extracted| &extracted.sources);
        let is_used = |entity: &Entity| sources.is_some_and(|sources| sources.iter().any(|s| s.entity == *entity));
        prepared.due.clear();
        prepared.sources.retain(|entity, _| is_used(entity));
    }
    for extracted in &extracted.0 {
        let Some(cube) = resources.images.get(extracted.cube) else {
            continue;
        };
        let prepared = prepared.0.entry(extracted.cube).or_insert_with(|| PreparedCube::new(cube, &resources.device));
        if prepared.prepare(extracted, cube, &resources) {
            writes.announce(extracted.cube);
        }
    }
}

impl PreparedCube {
    /// Prepares the dispatches that are due. Returns whether there are any.
    fn prepare(&mut self, extracted: &CubeSources, cube: &GpuImage, resources: &UnwrapResources) -> bool {
        let UnwrapResources { pipelines, pipeline_cache, images, device, queue } = resources;
        let is_ready = |source: &&ExtractedSource| {
            let pipeline = pipelines.id(source.view.key()).and_then(|id| pipeline_cache.get_compute_pipeline(id));
            pipeline.is_some() && images.get(source.frame).is_some()
        };
        let ready: Vec<&ExtractedSource> = extracted.sources.iter().filter(is_ready).collect();
        let has_measured = ready.iter().any(|source| !source.view.is_fallback());
        let fading = self.fading.toward(if has_measured { extracted.measured_fraction } else { 0.0 });
        let is_fading = has_measured && fading != self.fading;
        if !ready.iter().any(|source| self.is_new(source)) && !is_fading {
            return false;
        }
        let weight = self.fading.weight_to(fading);
        self.fading = fading;
        let captured = ready.iter().map(|source| source.captured).max().unwrap_or_default();
        let mut is_first = true;
        for source in ready {
            let buffers = self.sources.entry(source.entity).or_default();
            let is_news = !buffers.has_frame(source.sequence);
            let mut uniform = source.view.uniform(source.scale);
            if !source.view.is_fallback() {
                uniform.weight = weight;
                if is_first {
                    uniform.history_keep = self.history.keep(captured, if is_news { source.change } else { 0.0 });
                    uniform.history_is_old = 1.0;
                }
                if !is_first || !is_news {
                    uniform.history_scale = Vec3::ONE;
                }
                is_first = false;
            }
            buffers.write(uniform, &source.view, device, queue);
            let Some(frame) = images.get(source.frame) else { continue };
            let bind_group = buffers.bind_group([frame, cube], &self.history.view, pipelines, pipeline_cache, device);
            let Some(bind_group) = bind_group else { continue };
            self.due.push((source.view.key(), bind_group));
            buffers.made_from = Some((source.sequence, source.view.clone()));
        }
        self.history.captured = captured;
        self.cube = cube.texture.clone();
        true
    }
}
