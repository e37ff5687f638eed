//! Compute pass that writes the environment cube, with one dispatch per source, before all cameras.

use super::{history::History, prepare_unwraps::PreparedUnwraps, unwrap_pipeline::UnwrapPipelines};
use crate::{
    compute_pass::{compute_pass, workgroups},
    environment_map::EnvironmentCube,
};
use bevy::{
    prelude::*,
    render::{render_resource::PipelineCache, renderer::RenderContext},
};

pub(super) fn unwrap_pass(
    pipelines: Option<Res<UnwrapPipelines>>,
    prepared: Res<PreparedUnwraps>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipelines) = pipelines else {
        return;
    };
    for prepared in prepared.0.values() {
        for (key, bind_group) in &prepared.due {
            let Some(pipeline) = pipelines.id(*key).and_then(|id| pipeline_cache.get_compute_pipeline(id)) else {
                continue;
            };
            let groups = workgroups(EnvironmentCube::SIZE);
            compute_pass(&mut ctx, "mirrorball_probe_unwrap", |pass| {
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, bind_group, &[]);
                pass.dispatch_workgroups(groups, groups, 6);
            });
            let (cube, history) = (prepared.cube.as_image_copy(), prepared.history.texture.as_image_copy());
            ctx.command_encoder().copy_texture_to_texture(cube, history, History::EXTENT);
        }
    }
}
