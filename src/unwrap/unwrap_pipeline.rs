//! Layout and pipelines of the unwrap pass.

use super::unwrap_uniform::UnwrapUniform;
use crate::probe::SolidUniform;
use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, StorageTextureAccess, TextureFormat, TextureSampleType,
        binding_types::{
            storage_buffer_read_only, texture_2d, texture_2d_array, texture_storage_2d_array, uniform_buffer,
        },
    },
};

/// Shader variant: how a frame shows the surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum UnwrapPipelineKey {
    Ball,
    Fisheye,
    Equirect,
    SphereMap,
}

impl UnwrapPipelineKey {
    const ALL: [Self; 4] = [Self::Ball, Self::Fisheye, Self::Equirect, Self::SphereMap];

    fn shader_def(self) -> Option<&'static str> {
        match self {
            Self::Ball => Some("BALL"),
            Self::Fisheye => Some("FISHEYE"),
            Self::Equirect => Some("EQUIRECT"),
            Self::SphereMap => None,
        }
    }
}

/// Pipelines by key; all have the same bind group layout.
#[derive(Resource)]
pub(super) struct UnwrapPipelines {
    pub(super) layout: BindGroupLayoutDescriptor,
    ids: [(UnwrapPipelineKey, CachedComputePipelineId); 4],
}

impl UnwrapPipelines {
    pub(super) fn id(&self, key: UnwrapPipelineKey) -> Option<CachedComputePipelineId> {
        self.ids.iter().find(|(of, _)| *of == key).map(|(_, id)| *id)
    }
}

pub(super) fn init_unwrap_pipelines(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_probe_unwrap_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d(TextureSampleType::Float { filterable: true }),
                uniform_buffer::<UnwrapUniform>(false),
                storage_buffer_read_only::<Vec<Vec4>>(false),
                storage_buffer_read_only::<Vec<SolidUniform>>(false),
                storage_buffer_read_only::<Vec<SolidUniform>>(false),
                texture_2d_array(TextureSampleType::Float { filterable: true }),
                texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            ),
        ),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "unwrap_pass.wgsl");
    let ids = UnwrapPipelineKey::ALL.map(|key| {
        let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some("mirrorball_probe_unwrap_pipeline".into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            shader_defs: key.shader_def().into_iter().map(Into::into).collect(),
            entry_point: Some("unwrap_frame".into()),
            ..default()
        });
        (key, id)
    });
    commands.insert_resource(UnwrapPipelines { layout, ids });
}
