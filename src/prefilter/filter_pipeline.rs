//! Layouts and pipelines of the environment filter.

use super::{
    blocks::FACE_BLOCKS,
    lobe::{TapSet, TapsUniform},
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

/// Pipeline of one step of the filter, and the layout of its only bind group.
pub(super) struct FilterStep {
    pub(super) id: CachedComputePipelineId,
    pub(super) layout: BindGroupLayoutDescriptor,
}

/// Pipelines of all steps.
#[derive(Resource)]
pub(super) struct FilterPipelines {
    pub(super) resample_equirect: FilterStep,
    pub(super) resample_cube: FilterStep,
    pub(super) halve: FilterStep,
    pub(super) halve_and_copy: FilterStep,
    pub(super) smooth_halve: FilterStep,
    pub(super) sharpest: FilterStep,
    pub(super) gather_blocks: FilterStep,
    pub(super) diffuse: FilterStep,
    pub(super) specular_sum: FilterStep,
    pub(super) cosine_sum: FilterStep,
    pub(super) equalize: FilterStep,
    pub(super) few_taps: FilterStep,
    pub(super) many_taps: FilterStep,
    /// Interpolates linearly, and clamps at the edges of textures.
    pub(super) sampler: Sampler,
}

/// Bindings of a step.
type Bindings<'a> = &'a [(u32, BindGroupLayoutEntryBuilder)];

pub(super) fn init_filter_pipelines(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
    device: Res<RenderDevice>,
) {
    let step = |shader: &Handle<Shader>, entry_point: &'static str, bindings: Bindings, defs: Vec<ShaderDefVal>| {
        let entries: Vec<_> =
            bindings.iter().map(|(binding, entry)| entry.build(*binding, ShaderStages::COMPUTE)).collect();
        let layout = BindGroupLayoutDescriptor::new(format!("mirrorball_environment_{entry_point}_layout"), &entries);
        let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(format!("mirrorball_environment_{entry_point}").into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            shader_defs: defs,
            entry_point: Some(entry_point.into()),
            ..default()
        });
        FilterStep { id, layout }
    };
    let output = texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let texels = texture_2d_array(TextureSampleType::Float { filterable: false });
    let faces = texture_2d_array(TextureSampleType::Float { filterable: true });
    let filtering = sampler(SamplerBindingType::Filtering);

    let resample = load_embedded_asset!(asset_server.as_ref(), "resample.wgsl");
    let equirect = texture_2d(TextureSampleType::Float { filterable: false });
    let viewpoint = uniform_buffer::<Vec4>(false);

    let downsample = load_embedded_asset!(asset_server.as_ref(), "downsample.wgsl");

    let convolve = load_embedded_asset!(asset_server.as_ref(), "convolve.wgsl");
    let block_angles = uniform_buffer::<[Vec4; FACE_BLOCKS / 4]>(false);
    let (gathered, blocks) = (storage_buffer_sized(false, None), uniform_buffer_sized(false, None));
    let alpha = uniform_buffer::<f32>(false);
    let specular_sum = |defs| step(&convolve, "specular_sum", &[(3, blocks), (4, output), (5, alpha)], defs);

    let taps = load_embedded_asset!(asset_server.as_ref(), "taps.wgsl");
    let sharpness = uniform_buffer::<Vec2>(false);
    let equalize = [(0, filtering), (1, faces), (2, faces), (3, faces), (4, sharpness), (5, output)];
    let specular_taps = |set: TapSet| {
        let lobe = uniform_buffer::<TapsUniform>(false);
        let bindings = [(0, filtering), (5, output), (6, lobe), (7, texels), (8, faces), (9, faces), (10, faces)];
        step(&taps, "specular_taps", &bindings, set.shader_defs())
    };

    commands.insert_resource(FilterPipelines {
        resample_equirect: step(&resample, "resample_equirect", &[(0, output), (1, viewpoint), (2, equirect)], vec![]),
        resample_cube: step(&resample, "resample_cube", &[(0, output), (1, viewpoint), (3, texels)], vec![]),
        halve: step(&downsample, "halve", &[(0, texels), (1, output)], vec![]),
        halve_and_copy: step(&downsample, "halve", &[(0, texels), (1, output), (3, output)], vec!["COPIES".into()]),
        smooth_halve: step(&downsample, "smooth_halve", &[(0, faces), (1, output), (2, filtering)], vec![]),
        sharpest: step(&downsample, "sharpest", &[(0, texels), (3, output)], vec![]),
        gather_blocks: step(&convolve, "gather_blocks", &[(0, texels), (1, block_angles), (2, gathered)], vec![]),
        diffuse: step(&convolve, "diffuse", &[(3, blocks), (4, output)], vec![]),
        specular_sum: specular_sum(vec![]),
        cosine_sum: specular_sum(vec!["COSINE".into()]),
        equalize: step(&taps, "equalize", &equalize, vec![]),
        few_taps: specular_taps(TapSet::Few),
        many_taps: specular_taps(TapSet::Many),
        sampler: device.create_sampler(&SamplerDescriptor {
            label: Some("mirrorball_environment_sampler"),
            mag_filter: FilterMode::Linear,
            min_filter: FilterMode::Linear,
            ..default()
        }),
    });
}
