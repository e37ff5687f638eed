//! Compute pass that writes the environment cube, with one dispatch per source, before all cameras.

use super::{history::History, prepare_unwraps::PreparedUnwraps, unwrap_pipeline::UnwrapPipelines};
use crate::environment_map::EnvironmentCube;
use bevy::{
    prelude::*,
    render::{
        diagnostic::RecordDiagnostics,
        render_resource::{ComputePassDescriptor, PipelineCache},
        renderer::RenderContext,
    },
};

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;

pub(super) fn unwrap_pass(
    pipelines: Option<Res<UnwrapPipelines>>,
    prepared: Res<PreparedUnwraps>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(cube), Some(history)) = (pipelines, &prepared.cube, &prepared.history) else {
        return;
    };
    for (key, bind_group) in &prepared.due {
        let Some(pipeline) = pipelines.id(*key).and_then(|id| pipeline_cache.get_compute_pipeline(id)) else {
            continue;
        };
        let diagnostics = ctx.diagnostic_recorder();
        let diagnostics = diagnostics.as_deref();
        let encoder = ctx.command_encoder();
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("mirrorball_probe_unwrap_pass"),
            timestamp_writes: None,
        });
        let span = diagnostics.pass_span(&mut pass, "mirrorball_probe_unwrap");
        pass.set_pipeline(pipeline);
        let groups = EnvironmentCube::SIZE.div_ceil(WORKGROUP);
        pass.set_bind_group(0, bind_group, &[]);
        pass.dispatch_workgroups(groups, groups, 6);
        span.end(&mut pass);
        drop(pass);
        encoder.copy_texture_to_texture(cube.as_image_copy(), history.texture.as_image_copy(), History::EXTENT);
    }
}
