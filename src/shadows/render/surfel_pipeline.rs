//! Pipelines of the surfel pass, one set per permutation of the dome's shaders.

use super::visibility_pipeline::DOME_GROUP;
use crate::shadows::{atlas::LIT_BYTES, bounce::Surfel, filter::DomeShader};
use bevy::{
    asset::load_embedded_asset,
    platform::collections::HashMap,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId, ComputePipelineDescriptor,
        PipelineCache, ShaderStages, ShaderType,
        binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, uniform_buffer},
    },
    shader::ShaderDefVal,
};
use std::num::NonZero;

/// Mirror of `Surfels` in `surfel_pass.wgsl`.
#[derive(ShaderType, Clone, Copy, Debug, PartialEq)]
pub(super) struct SurfelsUniform {
    pub(super) up: Vec3,
    pub(super) count: u32,
    pub(super) covers_phantoms: u32,
    pub(super) has_horizon: u32,
}

/// Entry points of `surfel_pass.wgsl`.
const ENTRY_POINTS: [&str; 4] = ["receive", "estimate_albedo", "send", "receive_bounced"];

/// Layouts, shader and queued pipelines.
#[derive(Resource)]
pub(super) struct SurfelPipelines {
    pub(super) layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    queued: HashMap<DomeShader, [CachedComputePipelineId; 4]>,
}

pub(super) fn init_surfel_pipelines(mut commands: Commands, asset_server: Res<AssetServer>) {
    commands.insert_resource(SurfelPipelines {
        layout: BindGroupLayoutDescriptor::new(
            "mirrorball_shadows_surfels_layout",
            &BindGroupLayoutEntries::sequential(
                ShaderStages::COMPUTE,
                (
                    uniform_buffer::<SurfelsUniform>(false),
                    storage_buffer_read_only_sized(false, Some(Surfel::min_size())),
                    storage_buffer_sized(false, None),
                    storage_buffer_sized(false, None),
                    storage_buffer_sized(false, NonZero::new(LIT_BYTES as u64)),
                ),
            ),
        ),
        shader: load_embedded_asset!(asset_server.as_ref(), "surfel_pass.wgsl"),
        queued: HashMap::default(),
    });
}

impl SurfelPipelines {
    /// Returns the pipelines of a permutation in the order of their entry points. They are queued the first time.
    pub(super) fn of(
        &mut self,
        dome: DomeShader,
        dome_layout: &BindGroupLayoutDescriptor,
        cache: &PipelineCache,
    ) -> [CachedComputePipelineId; 4] {
        let Self { layout, shader, queued } = self;
        *queued.entry(dome).or_insert_with(|| {
            ENTRY_POINTS.map(|entry_point| {
                let group = ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), DOME_GROUP);
                cache.queue_compute_pipeline(ComputePipelineDescriptor {
                    label: Some(format!("mirrorball_shadows_surfels_{entry_point}").into()),
                    layout: vec![layout.clone(), dome_layout.clone()],
                    shader: shader.clone(),
                    shader_defs: std::iter::once(group).chain(dome.shader_defs()).collect(),
                    entry_point: Some(entry_point.into()),
                    ..default()
                })
            })
        })
    }
}
