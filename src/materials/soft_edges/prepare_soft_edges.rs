//! Pipeline and uniform of each view with soft edges.

use super::{
    SoftPhantomEdges,
    soft_edges_pipeline::{SoftEdgesPipeline, SoftEdgesPipelineKey, SoftEdgesUniform},
};
use bevy::{
    prelude::*,
    render::{
        render_resource::{CachedRenderPipelineId, PipelineCache, SpecializedRenderPipelines, UniformBuffer},
        renderer::{RenderDevice, RenderQueue},
        view::ExtractedView,
    },
};

/// Pipeline and uniform of a view with soft edges.
#[derive(Component)]
pub(super) struct PreparedSoftEdges {
    pub(super) pipeline: CachedRenderPipelineId,
    pub(super) is_multisampled: bool,
    pub(super) uniform: UniformBuffer<SoftEdgesUniform>,
    radius: f32,
}

type SoftView =
    (Entity, &'static SoftPhantomEdges, &'static ExtractedView, &'static Msaa, Option<&'static mut PreparedSoftEdges>);

pub(super) fn prepare_soft_edges(
    mut commands: Commands,
    mut views: Query<SoftView>,
    pipeline: Res<SoftEdgesPipeline>,
    mut pipelines: ResMut<SpecializedRenderPipelines<SoftEdgesPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    for (entity, edges, view, msaa, prepared) in &mut views {
        let is_multisampled = msaa.samples() > 1;
        let key = SoftEdgesPipelineKey { target_format: view.target_format, is_multisampled };
        let id = pipelines.specialize(&pipeline_cache, &pipeline, key);
        let wanted = if edges.radius.is_nan() { SoftPhantomEdges::default().radius } else { edges.radius };
        let radius = wanted.clamp(*SoftPhantomEdges::RADIUS.start(), *SoftPhantomEdges::RADIUS.end());
        if let Some(mut prepared) = prepared {
            (prepared.pipeline, prepared.is_multisampled) = (id, is_multisampled);
            if prepared.radius != radius {
                prepared.radius = radius;
                prepared.uniform.set(SoftEdgesUniform { radius });
                prepared.uniform.write_buffer(&device, &queue);
            }
            continue;
        }
        let mut uniform = UniformBuffer::from(SoftEdgesUniform { radius });
        uniform.set_label(Some("mirrorball_soft_edges_uniform"));
        uniform.write_buffer(&device, &queue);
        commands.entity(entity).insert(PreparedSoftEdges { pipeline: id, is_multisampled, uniform, radius });
    }
}
