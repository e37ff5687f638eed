//! Environment cube → radiance × solid angle of each direction, before all cameras.

use super::{
    dome::{self, Cells},
    extract::ExtractedDome,
    textures::DomeTextures,
};
use crate::MirrorballPasses;
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache, SamplerBindingType, ShaderStages,
            ShaderType, StorageBuffer, TextureSampleType, TextureViewId, UniformBuffer,
            binding_types::{
                sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_cube, uniform_buffer,
            },
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "weights_pass.wgsl");
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
        .init_resource::<PreparedWeights>()
        .add_systems(RenderStartup, init_weights_pipelines)
        .add_systems(Render, prepare_weights.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            RenderGraph,
            weights_pass.in_set(RenderGraphSystems::Render).after(MirrorballPasses::WriteCubes).before(camera_driver),
        );
}

/// Mirror of `Weights` in `weights_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct WeightsUniform {
    world_from_dome: Mat3,
    counts: UVec2,
}

#[derive(Resource)]
struct WeightsPipelines {
    layout: BindGroupLayoutDescriptor,
    weigh: CachedComputePipelineId,
    average: CachedComputePipelineId,
}

fn init_weights_pipelines(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_weights_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_cube(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                uniform_buffer::<WeightsUniform>(false),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_read_only_sized(false, None),
                storage_buffer_sized(false, None),
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
    let (weigh, average) = (queue("weigh_cells"), queue("average_below"));
    commands.insert_resource(WeightsPipelines { layout, weigh, average });
}

/// Cells of the current number of directions, and bindings that are remade only when what they were made from changes.
#[derive(Resource, Default)]
struct PreparedWeights {
    cells: Option<CellBuffers>,
    bind_group: Option<BindGroup>,
    made_from: Option<(TextureViewId, Quat, u32)>,
}

struct CellBuffers {
    directions: u32,
    patches: StorageBuffer<Vec<Vec4>>,
    ranges: StorageBuffer<Vec<UVec2>>,
}

impl CellBuffers {
    fn new(directions: u32, device: &RenderDevice, queue: &RenderQueue) -> Self {
        let cells = Cells::new(&dome::all_directions(directions));
        let mut patches = StorageBuffer::from(cells.patches);
        patches.set_label(Some("mirrorball_shadows_patches"));
        patches.write_buffer(device, queue);
        let mut ranges = StorageBuffer::from(cells.ranges);
        ranges.set_label(Some("mirrorball_shadows_ranges"));
        ranges.write_buffer(device, queue);
        Self { directions, patches, ranges }
    }
}

fn prepare_weights(
    mut prepared: ResMut<PreparedWeights>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    pipelines: Res<WeightsPipelines>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let directions = dome.fitted.directions;
    let cube = dome.cube.and_then(|id| images.get(id)).filter(|_| directions > 0);
    let made_from = cube.map(|cube| (cube.texture_view.id(), dome.fitted.world_from_dome, directions));
    if prepared.bind_group.is_some() && prepared.made_from == made_from {
        return;
    }
    (prepared.bind_group, prepared.made_from) = (None, made_from);
    let (Some(textures), Some(cube)) = (textures, cube) else {
        return;
    };
    let Some(weights) = buffers.get(&textures.weights) else {
        return;
    };
    if prepared.cells.as_ref().is_none_or(|cells| cells.directions != directions) {
        prepared.cells = Some(CellBuffers::new(directions, &device, &queue));
    }
    let mut uniform = UniformBuffer::from(WeightsUniform {
        world_from_dome: Mat3::from_quat(dome.fitted.world_from_dome),
        counts: UVec2::new(directions, 2 * directions),
    });
    uniform.set_label(Some("mirrorball_shadows_weights_uniform"));
    uniform.write_buffer(&device, &queue);
    let Some(cells) = &prepared.cells else {
        return;
    };
    let (Some(uniform), Some(patches), Some(ranges)) =
        (uniform.binding(), cells.patches.binding(), cells.ranges.binding())
    else {
        return;
    };
    let bind_group = device.create_bind_group(
        "mirrorball_shadows_weights_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipelines.layout),
        &BindGroupEntries::sequential((
            &cube.texture_view,
            &cube.sampler,
            uniform,
            patches,
            ranges,
            weights.buffer.as_entire_binding(),
        )),
    );
    prepared.bind_group = Some(bind_group);
}

fn weights_pass(
    pipelines: Option<Res<WeightsPipelines>>,
    prepared: Res<PreparedWeights>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(bind_group), Some((.., directions))) =
        (pipelines, &prepared.bind_group, prepared.made_from)
    else {
        return;
    };
    let (Some(weigh), Some(average)) =
        (pipeline_cache.get_compute_pipeline(pipelines.weigh), pipeline_cache.get_compute_pipeline(pipelines.average))
    else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_shadows_weights_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_weights");
    pass.set_bind_group(0, bind_group, &[]);
    pass.set_pipeline(weigh);
    pass.dispatch_workgroups(2 * directions, 1, 1);
    pass.set_pipeline(average);
    pass.dispatch_workgroups(1, 1, 1);
    span.end(&mut pass);
}
