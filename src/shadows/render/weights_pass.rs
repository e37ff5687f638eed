//! Environment cube → radiance × solid angle of each direction, before all cameras.

use super::{prepare_weights::PreparedWeights, weights_pipeline::WeightsPipelines};
use crate::environment_map::CubeWrites;
use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{ComputePassDescriptor, PipelineCache},
        renderer::RenderContext,
    },
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
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_shadows_weights_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_weights");
    pass.set_bind_group(0, bind_group, &[]);
    pass.set_pipeline(weigh);
    pass.dispatch_workgroups(sources.light_count(), 1, 1);
    pass.set_pipeline(average);
    pass.dispatch_workgroups(1, 1, 1);
    pass.set_pipeline(rank);
    pass.dispatch_workgroups(1, 1, 1);
    span.end(&mut pass);
    drop(pass);
    prepared.summed_writes = writes;
}
