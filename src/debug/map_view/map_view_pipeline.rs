//! Pipeline of the pass that draws map views.

use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, ShaderType, StorageTextureAccess, TextureFormat, TextureSampleType,
        binding_types::{texture_2d_array, texture_storage_2d, uniform_buffer},
    },
};

/// Mirror of `Shown` in `map_view_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct ShownUniform {
    pub(super) level: u32,
    pub(super) alpha: f32,
}

#[derive(Resource)]
pub(super) struct MapViewPipeline {
    pub(super) layout: BindGroupLayoutDescriptor,
    pub(super) id: CachedComputePipelineId,
}

pub(super) fn init_map_view_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_debug_map_view_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d_array(TextureSampleType::Float { filterable: false }),
                uniform_buffer::<ShownUniform>(false),
                texture_storage_2d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            ),
        ),
    );
    let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_debug_map_view".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "map_view_pass.wgsl"),
        entry_point: Some("show".into()),
        ..default()
    });
    commands.insert_resource(MapViewPipeline { layout, id });
}
