//! Layouts and pipelines of the environment filter.

use super::{
    filter_maker::{FACE_BLOCKS, TapsUniform},
    lobe::TapSet,
};
use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntryBuilder, CachedComputePipelineId, ComputePipelineDescriptor,
        FilterMode, PipelineCache, Sampler, SamplerBindingType, SamplerDescriptor, ShaderStages, StorageTextureAccess,
        TextureFormat, TextureSampleType,
        binding_types::{
            sampler, storage_buffer_sized, texture_2d, texture_2d_array, texture_storage_2d_array, uniform_buffer,
            uniform_buffer_sized,
        },
    },
    render::renderer::RenderDevice,
    shader::ShaderDefVal,
};

/// A pipeline and the layout of its only bind group.
pub(super) struct Step {
    pub(super) id: CachedComputePipelineId,
    pub(super) layout: BindGroupLayoutDescriptor,
}

#[derive(Resource)]
pub(super) struct FilterPipelines {
    pub(super) halve: Step,
    pub(super) halve_and_copy: Step,
    pub(super) smooth_halve: Step,
    pub(super) gather_blocks: Step,
    pub(super) diffuse: Step,
    pub(super) sharpest: Step,
    pub(super) even_out: Step,
    pub(super) few_taps: Step,
    pub(super) many_taps: Step,
    pub(super) glossy_sum: Step,
    pub(super) resample_equirect: Step,
    pub(super) resample_cube: Step,
    /// Linear, up to the edges of textures.
    pub(super) sampler: Sampler,
}

pub(super) fn init_filter_pipelines(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
) {
    let output = texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let texels = texture_2d_array(TextureSampleType::Float { filterable: false });
    let faces = texture_2d_array(TextureSampleType::Float { filterable: true });
    let filtering = sampler(SamplerBindingType::Filtering);
    let blocks = storage_buffer_sized(false, None);
    let summands = uniform_buffer_sized(false, None);
    let block_angles = uniform_buffer::<[Vec4; FACE_BLOCKS / 4]>(false);
    let shader = load_embedded_asset!(asset_server.as_ref(), "filter_pass.wgsl");
    let step_with = |entry_point: &'static str,
                     bindings: &[(u32, BindGroupLayoutEntryBuilder)],
                     shader_defs: Vec<ShaderDefVal>| {
        let entries: Vec<_> =
            bindings.iter().map(|(binding, entry)| entry.build(*binding, ShaderStages::COMPUTE)).collect();
        let layout = BindGroupLayoutDescriptor::new(format!("mirrorball_environment_{entry_point}_layout"), &entries);
        let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(format!("mirrorball_environment_{entry_point}").into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            shader_defs,
            entry_point: Some(entry_point.into()),
            ..default()
        });
        Step { id, layout }
    };
    let step = |entry_point: &'static str, bindings: &[(u32, BindGroupLayoutEntryBuilder)]| {
        step_with(entry_point, bindings, Vec::new())
    };
    let taps = |set: TapSet| {
        let places = uniform_buffer::<TapsUniform>(false);
        let bindings = [(3, filtering), (5, output), (6, places), (7, texels), (15, faces), (16, faces), (17, faces)];
        step_with("glossy_taps", &bindings, set.shader_defs())
    };
    let number = uniform_buffer::<f32>(false);
    let sharpness = uniform_buffer::<Vec2>(false);
    let viewpoint = uniform_buffer::<Vec4>(false);
    let equirect = texture_2d(TextureSampleType::Float { filterable: false });
    commands.insert_resource(FilterPipelines {
        sampler: device.create_sampler(&SamplerDescriptor {
            label: Some("mirrorball_environment_sampler"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..default()
        }),
        halve: step("halve", &[(0, texels), (1, output)]),
        halve_and_copy: step_with("halve", &[(0, texels), (1, output), (5, output)], vec!["COPIES".into()]),
        smooth_halve: step("smooth_halve", &[(0, faces), (1, output), (3, filtering)]),
        gather_blocks: step("gather_blocks", &[(0, texels), (8, blocks), (19, block_angles)]),
        diffuse: step("diffuse", &[(5, output), (14, summands)]),
        sharpest: step("sharpest", &[(0, texels), (5, output)]),
        even_out: step(
            "even_out",
            &[(3, filtering), (4, faces), (5, output), (18, sharpness), (20, faces), (21, faces)],
        ),
        few_taps: taps(TapSet::Few),
        many_taps: taps(TapSet::Many),
        glossy_sum: step("glossy_sum", &[(5, output), (12, number), (14, summands)]),
        resample_equirect: step("resample_equirect", &[(1, output), (9, equirect), (13, viewpoint)]),
        resample_cube: step("resample_cube", &[(1, output), (10, texels), (13, viewpoint)]),
    });
}
