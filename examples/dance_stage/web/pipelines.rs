//! Whether the device still waits for shaders. Pipelines belong to the renderer, which is an app of its own; a count
//! that both share says how many have to come.

use bevy::{
    prelude::*,
    render::{
        Render, RenderApp, RenderSystems,
        render_resource::{PipelineCache, PipelineDescriptor},
    },
};
use std::{
    collections::HashSet,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
};

/// Pipelines whose shaders are loading, as of the last picture.
#[derive(Resource, Clone)]
pub(super) struct LoadingPipelines(Arc<AtomicUsize>);

impl LoadingPipelines {
    pub(super) fn any(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }
}

/// Counts the pipelines. Until the first picture there is one to wait for.
pub(super) fn watch(app: &mut App) {
    let loading = LoadingPipelines(Arc::new(AtomicUsize::new(1)));
    app.insert_resource(loading.clone());
    if let Some(renderer) = app.get_sub_app_mut(RenderApp) {
        renderer.insert_resource(loading).add_systems(Render, count.in_set(RenderSystems::Cleanup));
    }
}

fn count(cache: Option<Res<PipelineCache>>, loading: Res<LoadingPipelines>) {
    let count = cache.map_or(1, |cache| {
        let waiting: HashSet<usize> = cache.waiting_pipelines().collect();
        let of_game = cache.pipelines().enumerate().filter(|(id, _)| waiting.contains(id));
        of_game.filter(|(_, pipeline)| !has_built_in_shader(&pipeline.descriptor)).count()
    });
    loading.0.store(count, Ordering::Relaxed);
}

/// Such shaders are there from the start, or never: Bevy asks for some that small devices do not have.
fn has_built_in_shader(pipeline: &PipelineDescriptor) -> bool {
    let shader = match pipeline {
        PipelineDescriptor::RenderPipelineDescriptor(of) => &of.vertex.shader,
        PipelineDescriptor::ComputePipelineDescriptor(of) => &of.shader,
    };
    matches!(shader.id(), AssetId::Uuid { .. })
}
