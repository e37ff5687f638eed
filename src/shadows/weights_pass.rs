//! Environment cube → radiance × solid angle of each direction, before all cameras.

use super::{
    FittedDome,
    depth_pass::filled_buffer,
    dome::{Cells, Directions},
    extract::ExtractedDome,
    key_lights::KeyLight,
    textures::DomeTextures,
};
use crate::{
    MirrorballPasses,
    environment_map::{CubeWrites, cube_faces},
};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache, ShaderStages, ShaderType, StorageBuffer,
            TextureSampleType, TextureUsages, TextureViewId, UniformBuffer,
            binding_types::{storage_buffer_read_only_sized, storage_buffer_sized, texture_2d_array, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
};
use std::{
    f32::consts::{FRAC_PI_2, PI},
    ops::RangeInclusive,
};

pub(super) fn build(app: &mut App) {
    crate::environment_map::load_shaders(app);
    embedded_asset!(app, "weights_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<PreparedWeights>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, init_weights_pipelines)
        .add_systems(Render, prepare_weights.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, weights_pass.in_set(MirrorballPasses::ReadCubes));
}

/// Mirror of `Weights` in `weights_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct WeightsUniform {
    cube_from_dome: Mat3,
    counts: UVec3,
    dim_share: f32,
    level: u32,
}

#[derive(Resource)]
struct WeightsPipelines {
    layout: BindGroupLayoutDescriptor,
    weigh: CachedComputePipelineId,
    average: CachedComputePipelineId,
    rank: CachedComputePipelineId,
}

fn init_weights_pipelines(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
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

/// Cells of the current directions, and bindings that are remade only when what they were made from changes.
#[derive(Resource, Default)]
struct PreparedWeights {
    cells: Option<CellBuffers>,
    bind_group: Option<BindGroup>,
    made_from: Option<WeightsSources>,
    /// How often the cube had been written when its light was weighed.
    weighed: Option<u32>,
}

#[derive(Clone, PartialEq)]
struct WeightsSources {
    view: TextureViewId,
    cube: AssetId<Image>,
    cube_from_dome: Quat,
    /// Whether the cube may be written on the GPU by passes that do not announce it.
    is_restless: bool,
    made_for: CellKey,
    keys: Vec<Vec4>,
    dim_share: f32,
}

/// Directions, and the edge of the cube by which the sphere is divided among them.
#[derive(Clone, PartialEq)]
struct CellKey {
    directions: Directions,
    edge: u32,
}

/// The light within this many angular radii of a key light's direction is its own, and within this many patches more, over
/// which the cube spreads it.
const CONE: f32 = 1.25;
const CONE_MARGIN: f32 = 1.5;
/// A cone that holds no direction.
const NO_CONE: Vec4 = Vec4::new(0.0, 0.0, 0.0, 2.0);
/// Edges of the cubes by which the sphere is divided: half that of the environment within these, so that a bilinear lookup
/// averages four texels and none is left out.
const CELL_EDGES: RangeInclusive<u32> = 16..=128;

struct CellBuffers {
    made_for: CellKey,
    patches: StorageBuffer<Vec<Vec4>>,
    ranges: StorageBuffer<Vec<UVec4>>,
}

impl CellBuffers {
    fn new(made_for: CellKey, device: &RenderDevice, queue: &RenderQueue) -> Self {
        let cells = Cells::new(&made_for.directions, made_for.edge);
        let mut patches = StorageBuffer::from(cells.patches);
        patches.set_label(Some("mirrorball_shadows_patches"));
        patches.write_buffer(device, queue);
        let mut ranges = StorageBuffer::from(cells.ranges);
        ranges.set_label(Some("mirrorball_shadows_ranges"));
        ranges.write_buffer(device, queue);
        Self { made_for, patches, ranges }
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
    let FittedDome { directions, keys, world_from_dome, dim_share, .. } = &dome.fitted;
    let is_there = !directions.shadowed.is_empty();
    let sky = dome.sky.and_then(|sky| images.get(sky.cube).map(|image| (sky, image))).filter(|_| is_there);
    let Some((sky, cube)) = sky.filter(|(_, image)| image.texture_descriptor.size.depth_or_array_layers == 6) else {
        *prepared = PreparedWeights { cells: prepared.cells.take(), ..default() };
        return;
    };
    let size = cube.texture_descriptor.size.width;
    let edge = (size / 2).clamp(*CELL_EDGES.start(), *CELL_EDGES.end());
    let made_for = CellKey { directions: directions.clone(), edge };
    if prepared.cells.as_ref().is_none_or(|cells| cells.made_for != made_for) {
        prepared.cells = Some(CellBuffers::new(made_for.clone(), &device, &queue));
    }
    let cone = |key: &KeyLight| {
        let radius = CONE * key.angular_radius + CONE_MARGIN * FRAC_PI_2 / edge as f32;
        (world_from_dome.inverse() * key.seen_in).extend(radius.min(PI).cos())
    };
    let keys: Vec<Vec4> = keys.iter().map(|key| key.as_ref().map_or(NO_CONE, cone)).collect();
    let made_from = Some(WeightsSources {
        view: cube.texture_view.id(),
        cube: sky.cube,
        cube_from_dome: sky.cube_from_world * *world_from_dome,
        is_restless: cube.texture_descriptor.usage.contains(TextureUsages::STORAGE_BINDING) && !sky.is_measured,
        made_for,
        keys: keys.clone(),
        dim_share: *dim_share,
    });
    if prepared.bind_group.is_some() && prepared.made_from == made_from {
        return;
    }
    let counts = UVec3::new(directions.shadowed.len() as u32, keys.len() as u32, directions.below.len() as u32);
    (prepared.bind_group, prepared.made_from, prepared.weighed) = (None, made_from, None);
    let Some(weights) = textures.and_then(|textures| buffers.get(&textures.weights)) else {
        return;
    };
    let level = (size / (2 * edge)).max(1).ilog2();
    let mut uniform = UniformBuffer::from(WeightsUniform {
        cube_from_dome: Mat3::from_quat(sky.cube_from_world * *world_from_dome),
        counts,
        dim_share: *dim_share,
        level: level.min(cube.texture_descriptor.mip_level_count - 1),
    });
    uniform.set_label(Some("mirrorball_shadows_weights_uniform"));
    uniform.write_buffer(&device, &queue);
    let keys = filled_buffer("mirrorball_shadows_keys", keys, NO_CONE, &device, &queue);
    let Some(cells) = &prepared.cells else {
        return;
    };
    let (Some(uniform), Some(patches), Some(ranges), Some(keys)) =
        (uniform.binding(), cells.patches.binding(), cells.ranges.binding(), keys.binding())
    else {
        return;
    };
    let bind_group = device.create_bind_group(
        "mirrorball_shadows_weights_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipelines.layout),
        &BindGroupEntries::sequential((
            &cube_faces(&cube.texture),
            uniform,
            patches,
            ranges,
            weights.buffer.as_entire_binding(),
            keys,
        )),
    );
    prepared.bind_group = Some(bind_group);
}

fn weights_pass(
    pipelines: Option<Res<WeightsPipelines>>,
    mut prepared: ResMut<PreparedWeights>,
    writes: Res<CubeWrites>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(bind_group), Some(sources)) = (pipelines, &prepared.bind_group, &prepared.made_from)
    else {
        return;
    };
    let written = Some(writes.count(sources.cube));
    if prepared.weighed == written && !sources.is_restless {
        return;
    }
    let (Some(weigh), Some(average), Some(rank)) = (
        pipeline_cache.get_compute_pipeline(pipelines.weigh),
        pipeline_cache.get_compute_pipeline(pipelines.average),
        pipeline_cache.get_compute_pipeline(pipelines.rank),
    ) else {
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
    pass.dispatch_workgroups((sources.made_for.directions.all().count() + sources.keys.len()) as u32, 1, 1);
    pass.set_pipeline(average);
    pass.dispatch_workgroups(1, 1, 1);
    pass.set_pipeline(rank);
    pass.dispatch_workgroups(1, 1, 1);
    span.end(&mut pass);
    drop(pass);
    prepared.weighed = written;
}
