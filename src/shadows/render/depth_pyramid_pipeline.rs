//! Pipeline that reduces the shadow maps of key lights to depth pyramids.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, ShaderType,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, texture_depth_2d},
    },
};

/// Mirror of `PyramidTile` in `depth_pyramid_pass.wgsl`.
#[derive(ShaderType, Clone, Copy, Default)]
pub(super) struct PyramidTile {
    pub(super) corner: UVec2,
    pub(super) edge: u32,
    pub(super) first_block: u32,
}

#[derive(Resource)]
pub(super) struct DepthPyramidPipeline {
    pub(super) layout: BindGroupLayoutDescriptor,
    pub(super) reduce: CachedComputePipelineId,
}

pub(super) fn init_depth_pyramid_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_pyramid_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (texture_depth_2d(), storage_buffer_read_only_sized(false, None), storage_buffer_sized(false, None)),
        ),
    );
    let reduce = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_shadows_depth_pyramid".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "depth_pyramid_pass.wgsl"),
        entry_point: Some("reduce".into()),
        ..default()
    });
    commands.insert_resource(DepthPyramidPipeline { layout, reduce });
}
