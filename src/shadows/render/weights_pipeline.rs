//! Pipelines of the weights pass.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, ShaderType, TextureSampleType,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, texture_2d_array, uniform_buffer},
    },
};

/// Mirror of `Weights` in `weights_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct WeightsUniform {
    pub(super) cube_from_dome: Mat3,
    pub(super) counts: UVec3,
    pub(super) dim_share: f32,
    pub(super) level: u32,
}

/// One pipeline per dispatch.
#[derive(Resource)]
pub(super) struct WeightsPipelines {
    pub(super) layout: BindGroupLayoutDescriptor,
    pub(super) weigh: CachedComputePipelineId,
    pub(super) average: CachedComputePipelineId,
    pub(super) rank: CachedComputePipelineId,
}

pub(super) fn init_weights_pipelines(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_weights_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d_array(TextureSampleType::Float { filterable: false }),
                uniform_buffer::<WeightsUniform>(false),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_sized(false, None),
                storage_buffer_read_only_sized(false, None),
            ),
        ),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "weights_pass.wgsl");
    let queue = |entry_point: &'static str| {
        pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(format!("mirrorball_shadows_{entry_point}").into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            entry_point: Some(entry_point.into()),
            ..default()
        })
    };
    let (weigh, average, rank) = (queue("weigh_cells"), queue("average_below"), queue("rank_directions"));
    commands.insert_resource(WeightsPipelines { layout, weigh, average, rank });
}
