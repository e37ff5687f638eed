//! Pipeline that weighs the directions of the ambient light.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, ShaderType, TextureSampleType,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, texture_2d_array, uniform_buffer},
    },
};

/// Mirror of `Sky` in `planar_sky_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct SkyUniform {
    pub(super) map_from_receiver: Mat3,
    pub(super) first_view: u32,
    pub(super) count: u32,
    pub(super) level: u32,
}

#[derive(Resource)]
pub(super) struct SkyPipeline {
    pub(super) layout: BindGroupLayoutDescriptor,
    pub(super) weigh: CachedComputePipelineId,
}

pub(super) fn init_sky_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_planar_sky_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d_array(TextureSampleType::Float { filterable: false }),
                uniform_buffer::<SkyUniform>(false),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_sized(false, None),
            ),
        ),
    );
    let weigh = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_shadows_planar_weigh_sky".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "planar_sky_pass.wgsl"),
        entry_point: Some("weigh_sky".into()),
        ..default()
    });
    commands.insert_resource(SkyPipeline { layout, weigh });
}
