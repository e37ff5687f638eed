//! Environment cube → irradiance and glossy maps, before all cameras.
//!
//! Per source: a pyramid of means; the light of 6·16² blocks at their energy centroids, summed with the cosine for each pair of
//! 6·32² opposite normals, and with GGX for the rough glossy levels; and tables of taps for the sharp ones. For a 128² source
//! that is 0.35 million texel reads, 0.9 million filtered lookups and 7.8 million multiplications with a lobe, where Bevy's
//! generator makes 7.7 million lookups at computed places. All bind groups are made once.

use super::{
    FilteredEnvironment, Refresh,
    lobe::{self, MAX_TAPS},
    refresh::Progress,
    source::SourceShape,
};
use crate::{MirrorballPasses, probe::CubeWrites};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    platform::collections::HashMap,
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer, BufferDescriptor,
            BufferUsages, CachedComputePipelineId, CommandEncoder, ComputePassDescriptor, ComputePipelineDescriptor,
            Extent3d, PipelineCache, SamplerBindingType, ShaderStages, ShaderType, StorageTextureAccess,
            TexelCopyTextureInfo, Texture, TextureFormat, TextureSampleType, TextureView, TextureViewDescriptor,
            TextureViewDimension, TextureViewId, UniformBuffer,
            binding_types::{
                sampler, storage_buffer_sized, texture_2d, texture_2d_array, texture_cube, texture_storage_2d_array,
                uniform_buffer,
            },
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "filter_pass.wgsl");
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        warn!("EnvironmentPlugin: no renderer, environments will not be filtered");
        return;
    };
    render_app
        .init_resource::<ExtractedEnvironments>()
        .init_resource::<PreparedFilters>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, init_filter_pipelines)
        .add_systems(ExtractSchedule, extract_environments)
        .add_systems(Render, prepare_filters.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            RenderGraph,
            filter_pass.in_set(RenderGraphSystems::Render).after(MirrorballPasses::WriteCubes).before(camera_driver),
        );
}

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;
/// Texels that a thread of the sums works on, and threads in its workgroup, as in the shader.
const QUAD: u32 = 4;
const QUAD_WORKGROUP: u32 = 64;
/// Blocks along a cube edge, as in the shader, and bytes of a block.
const BLOCK_EDGE: u32 = 16;
const BLOCK_BYTES: u32 = 32;
/// Largest edge length that the blocks are gathered from.
const MAX_GATHER_EDGE: u32 = 128;
/// Glossy levels up to this edge length are whole sums over the blocks.
const MAX_SUM_EDGE: u32 = 16;

/// Rings of taps and taps in each, for a level with this edge length: fewer where texels are many and lobes narrow.
fn tap_rings(edge: u32) -> (usize, usize) {
    match edge {
        128.. => (3, 4),
        64.. => (4, 6),
        _ => (6, 8),
    }
}
/// Added to the level of the pyramid that has a tap's solid angle. Finer levels are sharper, but let small lights show between
/// the taps: at −0.5, two suns come out 10 % too bright.
const LEVEL_BIAS: f64 = 0.0;

/// Mirror of `Convolve` in `filter_pass.wgsl`.
#[derive(ShaderType, Clone)]
struct ConvolveUniform {
    alpha: f32,
    tap_count: u32,
    coarsest_level: f32,
    taps: [Vec4; MAX_TAPS],
    weights: [Vec4; MAX_TAPS / 4],
}

#[derive(Resource, Default)]
struct ExtractedEnvironments(Vec<FilteredEnvironment>);

fn extract_environments(
    mut extracted: ResMut<ExtractedEnvironments>,
    environments: Extract<Query<&FilteredEnvironment>>,
) {
    extracted.0.clear();
    extracted.0.extend(environments.iter().cloned());
}

#[derive(Resource)]
struct FilterPipelines {
    reduce_layout: BindGroupLayoutDescriptor,
    convolve_layout: BindGroupLayoutDescriptor,
    equirect_layout: BindGroupLayoutDescriptor,
    cube_layout: BindGroupLayoutDescriptor,
    reduce: CachedComputePipelineId,
    gather_blocks: CachedComputePipelineId,
    diffuse: CachedComputePipelineId,
    sharpest: CachedComputePipelineId,
    glossy_taps: CachedComputePipelineId,
    glossy_sum: CachedComputePipelineId,
    resample_equirect: CachedComputePipelineId,
    resample_cube: CachedComputePipelineId,
}

fn init_filter_pipelines(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let output = texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let texels = texture_2d_array(TextureSampleType::Float { filterable: false });
    let cube = texture_cube(TextureSampleType::Float { filterable: true });
    let filtering = sampler(SamplerBindingType::Filtering);
    let reduce_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_environment_reduce_layout",
        &BindGroupLayoutEntries::with_indices(ShaderStages::COMPUTE, ((0, texels), (1, output))),
    );
    let convolve_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_environment_convolve_layout",
        &BindGroupLayoutEntries::with_indices(
            ShaderStages::COMPUTE,
            (
                (3, cube),
                (4, filtering),
                (5, output),
                (6, uniform_buffer::<ConvolveUniform>(false)),
                (7, texels),
                (8, storage_buffer_sized(false, None)),
            ),
        ),
    );
    let equirect_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_environment_equirect_layout",
        &BindGroupLayoutEntries::with_indices(
            ShaderStages::COMPUTE,
            ((1, output), (9, texture_2d(TextureSampleType::Float { filterable: false }))),
        ),
    );
    let cube_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_environment_cube_layout",
        &BindGroupLayoutEntries::with_indices(ShaderStages::COMPUTE, ((1, output), (10, cube), (11, filtering))),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "filter_pass.wgsl");
    let queue = |entry_point: &'static str, layout: &BindGroupLayoutDescriptor| {
        pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(format!("mirrorball_environment_{entry_point}").into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            entry_point: Some(entry_point.into()),
            ..default()
        })
    };
    commands.insert_resource(FilterPipelines {
        reduce: queue("reduce", &reduce_layout),
        gather_blocks: queue("gather_blocks", &convolve_layout),
        diffuse: queue("diffuse", &convolve_layout),
        sharpest: queue("sharpest", &convolve_layout),
        glossy_taps: queue("glossy_taps", &convolve_layout),
        glossy_sum: queue("glossy_sum", &convolve_layout),
        resample_equirect: queue("resample_equirect", &equirect_layout),
        resample_cube: queue("resample_cube", &cube_layout),
        reduce_layout,
        convolve_layout,
        equirect_layout,
        cube_layout,
    });
}

/// One dispatch: pipeline, bindings, workgroups.
struct Dispatch {
    pipeline: CachedComputePipelineId,
    bind_group: BindGroup,
    groups: UVec3,
}

/// Workgroups of one thread for each texel of a cube.
fn texel_groups(edge: u32) -> UVec3 {
    UVec2::splat(edge.div_ceil(WORKGROUP)).extend(6)
}

/// Workgroups of one thread for each quad of a number of faces.
fn quad_groups(edge: u32, faces: u32) -> UVec3 {
    UVec3::new((edge * edge / QUAD).div_ceil(QUAD_WORKGROUP), 1, faces)
}

/// Everything to filter one environment; made once and kept as long as its textures live.
struct Filter {
    made_from: TextureViewId,
    source: AssetId<Image>,
    dispatches: Vec<Dispatch>,
    /// The first of them, up to here, read the source and belong together.
    capture: usize,
    /// Dispatches per frame.
    budget: usize,
    /// Draft and finished map, copied when a set is complete.
    publish: Vec<(Texture, Texture)>,
    progress: Progress,
    /// The dispatch the current set has come to; 0 between sets.
    next: usize,
    /// Request that the last set answered, and what had been written to the source then.
    answered: Option<(u32, u32)>,
}

#[derive(Resource, Default)]
struct PreparedFilters(HashMap<AssetId<Image>, Filter>);

fn prepare_filters(
    mut filters: ResMut<PreparedFilters>,
    environments: Res<ExtractedEnvironments>,
    pipelines: Res<FilterPipelines>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    filters.0.retain(|diffuse, _| environments.0.iter().any(|environment| environment.diffuse.id() == *diffuse));
    for environment in &environments.0 {
        let Some(source) = images.get(&environment.source) else {
            continue;
        };
        let existing = filters.0.get(&environment.diffuse.id());
        if existing.is_some_and(|filter| filter.made_from == source.texture_view.id()) {
            continue;
        }
        let size = source.texture.size();
        let is_expected = match environment.shape {
            SourceShape::Cube(edge) => (edge, edge, 6),
            SourceShape::Equirect(width) => (width, width / 2, 1),
        } == (size.width, size.height, size.depth_or_array_layers);
        if !is_expected {
            // It has just been resized; the maps follow.
            filters.0.remove(&environment.diffuse.id());
            continue;
        }
        let maker = FilterMaker { pipelines: &pipelines, cache: &pipeline_cache, device: &device, queue: &queue };
        if let Some(filter) = maker.make(environment, source, &images) {
            filters.0.insert(environment.diffuse.id(), filter);
        }
    }
}

struct FilterMaker<'a> {
    pipelines: &'a FilterPipelines,
    cache: &'a PipelineCache,
    device: &'a RenderDevice,
    queue: &'a RenderQueue,
}

impl FilterMaker<'_> {
    /// `None` while a texture is missing.
    fn make(
        &self,
        environment: &FilteredEnvironment,
        source: &GpuImage,
        images: &RenderAssets<GpuImage>,
    ) -> Option<Filter> {
        let pyramid = images.get(&environment.pyramid)?;
        let shown = [images.get(&environment.diffuse)?, images.get(&environment.glossy)?];
        let mut dispatches = Vec::new();
        let cube = match &environment.resampled {
            Some(resampled) => {
                let resampled = images.get(resampled)?;
                dispatches.push(self.resample(environment.shape, source, &resampled.texture));
                resampled
            }
            None => source,
        };
        for level in 0..pyramid.texture.mip_level_count() {
            let finer = match level.checked_sub(1) {
                Some(above) => texels(&pyramid.texture, above),
                None => texels(&cube.texture, 0),
            };
            let bind_group = self.device.create_bind_group(
                "mirrorball_environment_reduce_bind_group",
                &self.cache.get_bind_group_layout(&self.pipelines.reduce_layout),
                &BindGroupEntries::with_indices(((0, &finer), (1, &texels(&pyramid.texture, level)))),
            );
            let edge = pyramid.texture.width() >> level;
            dispatches.push(Dispatch { pipeline: self.pipelines.reduce, bind_group, groups: texel_groups(edge) });
        }
        let (made, publish) = match &environment.draft {
            Some([diffuse, glossy]) => {
                let draft = [images.get(diffuse)?, images.get(glossy)?];
                (draft, draft.iter().zip(shown).map(|(a, b)| (a.texture.clone(), b.texture.clone())).collect())
            }
            None => (shown, Vec::new()),
        };
        let [diffuse, glossy] = made.map(|image| &image.texture);
        let blocks = self.device.create_buffer(&BufferDescriptor {
            label: Some("mirrorball_environment_blocks"),
            size: u64::from(6 * BLOCK_EDGE * BLOCK_EDGE * BLOCK_BYTES),
            usage: BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        // The cube or its pyramid where it has at most this edge length.
        let level_of = |max_edge: u32| match (cube.texture.width() / max_edge).max(1).ilog2() {
            0 => texels(&cube.texture, 0),
            level => texels(&pyramid.texture, level - 1),
        };
        let convolve = |pipeline, input: &TextureView, target: &Texture, level: u32, groups: UVec3, uniform| {
            let bind_group = self.convolve_bindings(pyramid, input, &texels(target, level), uniform, &blocks)?;
            Some(Dispatch { pipeline, bind_group, groups })
        };
        let plain = ConvolveUniform {
            alpha: 1.0,
            tap_count: 0,
            coarsest_level: (pyramid.texture.mip_level_count() - 1) as f32,
            taps: [Vec4::ZERO; MAX_TAPS],
            weights: [Vec4::ZERO; MAX_TAPS / 4],
        };
        let gather = level_of(MAX_GATHER_EDGE);
        let pipelines = self.pipelines;
        dispatches.push(convolve(
            pipelines.gather_blocks,
            &gather,
            diffuse,
            0,
            texel_groups(BLOCK_EDGE),
            plain.clone(),
        )?);
        let edge = glossy.width();
        dispatches.push(convolve(pipelines.sharpest, &level_of(edge), glossy, 0, texel_groups(edge), plain.clone())?);
        let capture = dispatches.len();
        dispatches.push(convolve(
            pipelines.diffuse,
            &gather,
            diffuse,
            0,
            quad_groups(diffuse.width(), 3),
            plain.clone(),
        )?);
        let levels = glossy.mip_level_count();
        for level in 1..levels {
            let edge = glossy.width() >> level;
            let alpha = (f64::from(level) / f64::from(levels - 1)).powi(2);
            let mut uniform = ConvolveUniform { alpha: alpha as f32, ..plain.clone() };
            let (pipeline, groups) = if edge > MAX_SUM_EDGE {
                let (rings, per_ring) = tap_rings(edge);
                let taps = lobe::taps(alpha, rings, per_ring, cube.texture.width(), LEVEL_BIAS);
                uniform.tap_count = taps.len() as u32;
                for (i, tap) in taps.iter().enumerate() {
                    uniform.taps[i] = tap.place;
                    uniform.weights[i / 4][i % 4] = tap.weight;
                }
                (pipelines.glossy_taps, texel_groups(edge))
            } else {
                (pipelines.glossy_sum, quad_groups(edge, 6))
            };
            dispatches.push(convolve(pipeline, &gather, glossy, level, groups, uniform)?);
        }
        let budget = match environment.refresh {
            Refresh::Budget { dispatches } => dispatches.max(1) as usize,
            _ => usize::MAX,
        };
        Some(Filter {
            made_from: source.texture_view.id(),
            source: environment.source.id(),
            dispatches,
            capture,
            budget,
            publish,
            progress: environment.progress.clone(),
            next: 0,
            answered: None,
        })
    }

    fn resample(&self, shape: SourceShape, source: &GpuImage, cube: &Texture) -> Dispatch {
        let view = |dimension| {
            source.texture.create_view(&TextureViewDescriptor {
                label: Some("mirrorball_environment_source"),
                dimension: Some(dimension),
                mip_level_count: Some(1),
                ..default()
            })
        };
        let (pipeline, bind_group) = match shape {
            SourceShape::Equirect(_) => (
                self.pipelines.resample_equirect,
                self.device.create_bind_group(
                    "mirrorball_environment_equirect_bind_group",
                    &self.cache.get_bind_group_layout(&self.pipelines.equirect_layout),
                    &BindGroupEntries::with_indices(((1, &texels(cube, 0)), (9, &view(TextureViewDimension::D2)))),
                ),
            ),
            SourceShape::Cube(_) => (
                self.pipelines.resample_cube,
                self.device.create_bind_group(
                    "mirrorball_environment_cube_bind_group",
                    &self.cache.get_bind_group_layout(&self.pipelines.cube_layout),
                    &BindGroupEntries::with_indices((
                        (1, &texels(cube, 0)),
                        (10, &view(TextureViewDimension::Cube)),
                        (11, &source.sampler),
                    )),
                ),
            ),
        };
        Dispatch { pipeline, bind_group, groups: texel_groups(cube.width()) }
    }

    fn convolve_bindings(
        &self,
        pyramid: &GpuImage,
        input: &TextureView,
        output: &TextureView,
        uniform: ConvolveUniform,
        blocks: &Buffer,
    ) -> Option<BindGroup> {
        let mut buffer = UniformBuffer::from(uniform);
        buffer.set_label(Some("mirrorball_environment_convolve_uniform"));
        buffer.write_buffer(self.device, self.queue);
        let cube = pyramid.texture.create_view(&TextureViewDescriptor {
            label: Some("mirrorball_environment_cube"),
            dimension: Some(TextureViewDimension::Cube),
            ..default()
        });
        Some(self.device.create_bind_group(
            "mirrorball_environment_convolve_bind_group",
            &self.cache.get_bind_group_layout(&self.pipelines.convolve_layout),
            &BindGroupEntries::with_indices((
                (3, &cube),
                (4, &pyramid.sampler),
                (5, output),
                (6, buffer.binding()?),
                (7, input),
                (8, blocks.as_entire_binding()),
            )),
        ))
    }
}

/// One level of a cube as an array of six layers.
fn texels(texture: &Texture, level: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        label: Some("mirrorball_environment_level"),
        dimension: Some(TextureViewDimension::D2Array),
        base_mip_level: level,
        mip_level_count: Some(1),
        ..default()
    })
}

fn filter_pass(
    mut filters: ResMut<PreparedFilters>,
    writes: Res<CubeWrites>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    for filter in filters.0.values_mut() {
        let due = (filter.progress.requested(), writes.count(filter.source));
        let is_ready = |dispatch: &Dispatch| pipeline_cache.get_compute_pipeline(dispatch.pipeline).is_some();
        if filter.next == 0 && (filter.answered == Some(due) || !filter.dispatches.iter().all(is_ready)) {
            continue;
        }
        let first = filter.next;
        let count = match first {
            0 => filter.budget.saturating_add(filter.capture - 1),
            _ => filter.budget,
        };
        let end = first.saturating_add(count).min(filter.dispatches.len());
        if first == 0 {
            filter.answered = Some(due);
        }
        let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
            label: Some("mirrorball_environment_filter_pass"),
            timestamp_writes: None,
        });
        let span = diagnostics.pass_span(&mut pass, "mirrorball_environment_filter");
        for dispatch in &filter.dispatches[first..end] {
            let Some(pipeline) = pipeline_cache.get_compute_pipeline(dispatch.pipeline) else {
                break;
            };
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, &dispatch.bind_group, &[]);
            pass.dispatch_workgroups(dispatch.groups.x, dispatch.groups.y, dispatch.groups.z);
        }
        span.end(&mut pass);
        drop(pass);
        filter.next = if end == filter.dispatches.len() { 0 } else { end };
        if filter.next == 0 {
            for (draft, shown) in &filter.publish {
                copy_levels(ctx.command_encoder(), draft, shown);
            }
            filter.progress.finish();
        }
    }
}

fn copy_levels(encoder: &mut CommandEncoder, from: &Texture, to: &Texture) {
    for mip_level in 0..from.mip_level_count() {
        let edge = from.width() >> mip_level;
        encoder.copy_texture_to_texture(
            TexelCopyTextureInfo { mip_level, ..from.as_image_copy() },
            TexelCopyTextureInfo { mip_level, ..to.as_image_copy() },
            Extent3d { width: edge, height: edge, depth_or_array_layers: 6 },
        );
    }
}
