//! Environment cube → radiance × solid angle of each direction, before all cameras.

use super::{prepare_weights::PreparedWeights, weights_pipeline::WeightsPipelines};
use crate::{compute_pass::compute_pass, environment_map::CubeWrites};
use bevy::{
    prelude::*,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

pub(super) fn weights_pass(
    pipelines: Option<Res<WeightsPipelines>>,
    mut prepared: ResMut<PreparedWeights>,
    writes: Res<CubeWrites>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(bind_group), Some(sources)) = (pipelines, &prepared.bind_group, &prepared.made_from)
    else {
        return;
    };
    let writes = Some(writes.count(sources.cube));
    if prepared.summed_writes == writes && !sources.is_restless {
        return;
    }
    let (Some(weigh), Some(average), Some(rank)) = (
        pipeline_cache.get_compute_pipeline(pipelines.weigh),
        pipeline_cache.get_compute_pipeline(pipelines.average),
        pipeline_cache.get_compute_pipeline(pipelines.rank),
    ) else {
        return;
    };
    compute_pass(&mut ctx, "mirrorball_shadows_weights", |pass| {
        pass.set_bind_group(0, bind_group, &[]);
        pass.set_pipeline(weigh);
        pass.dispatch_workgroups(sources.light_count(), 1, 1);
        pass.set_pipeline(average);
        pass.dispatch_workgroups(1, 1, 1);
        pass.set_pipeline(rank);
        pass.dispatch_workgroups(1, 1, 1);
    });
    prepared.summed_writes = writes;
    prepared.sums = prepared.sums.wrapping_add(1);
}
