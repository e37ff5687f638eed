//! Pictures of the light → environment cube, one compute dispatch for each before all cameras.

use super::extract::{ExtractedSource, ExtractedSources, PictureKind, SourceView, UnwrapUniform, extract_sources};
use crate::{
    MirrorballPasses,
    environment_map::{self, CubeWrites, EnvironmentCube, cube_faces},
    lighting::ClipGains,
    probe::{self, ProbeLens, SolidUniform},
};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    platform::collections::HashMap,
    prelude::*,
    render::{
        ExtractSchedule, Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, Extent3d, PipelineCache, ShaderStages, StorageBuffer,
            StorageTextureAccess, Texture, TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType,
            TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension, TextureViewId, UniformBuffer,
            binding_types::{
                storage_buffer_read_only, texture_2d, texture_2d_array, texture_storage_2d_array, uniform_buffer,
            },
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderQueue},
        texture::GpuImage,
    },
};
use std::time::Duration;

/// Seconds after which what is no longer seen is worth a third.
const MEMORY_SECONDS: f32 = 4.0;
/// How much faster it loses worth while the rest changes: with the exponent of this times the share by which it has.
const CHANGE_FORGETS: f32 = 6.0;
/// Smaller steps from the assumed to the measured environment would get lost in the rounding of half floats.
const LEAST_STEP: f32 = 1.0 / 64.0;
pub(super) fn build(app: &mut App) {
    crate::trigonometry::load(app);
    environment_map::load_shaders(app);
    probe::load_shaders(app);
    embedded_asset!(app, "unwrap_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<ExtractedSources>()
        .init_resource::<PreparedUnwraps>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, init_unwrap_pipelines)
        .add_systems(ExtractSchedule, extract_sources)
        .add_systems(Render, prepare_unwraps.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, unwrap_pass.in_set(MirrorballPasses::WriteCubes));
}

#[derive(Resource)]
struct UnwrapPipelines {
    layout: BindGroupLayoutDescriptor,
    ids: [(PictureKind, CachedComputePipelineId); 4],
}

impl UnwrapPipelines {
    fn id(&self, kind: PictureKind) -> Option<CachedComputePipelineId> {
        self.ids.iter().find(|(of, _)| *of == kind).map(|(_, id)| *id)
    }
}

fn init_unwrap_pipelines(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
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
    let ids = PictureKind::ALL.map(|kind| {
        let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some("mirrorball_probe_unwrap_pipeline".into()),
            layout: vec![layout.clone()],
            shader: shader.clone(),
            shader_defs: kind.definition().into_iter().map(Into::into).collect(),
            entry_point: Some("unwrap_picture".into()),
            ..default()
        });
        (kind, id)
    });
    commands.insert_resource(UnwrapPipelines { layout, ids });
}

/// What one source needs on the GPU, and what the cube was last made from.
struct PreparedSource {
    uniform: UniformBuffer<UnwrapUniform>,
    gains: StorageBuffer<Vec<Vec4>>,
    blockers: StorageBuffer<Vec<SolidUniform>>,
    shown: StorageBuffer<Vec<SolidUniform>>,
    bind_group: Option<([TextureViewId; 2], BindGroup)>,
    made_from: Option<(u64, SourceView)>,
}

impl Default for PreparedSource {
    fn default() -> Self {
        let mut uniform = UniformBuffer::from(UnwrapUniform::plain(
            ProbeLens::Equirect.numbers(UVec2::ONE),
            Mat3::IDENTITY,
            Vec3::ONE,
        ));
        uniform.set_label(Some("mirrorball_probe_unwrap_uniform"));
        let mut gains = StorageBuffer::from(vec![Vec4::ONE; ClipGains::COUNT]);
        gains.set_label(Some("mirrorball_probe_clip_gains"));
        Self {
            uniform,
            gains,
            blockers: solids_buffer(&[]),
            shown: solids_buffer(&[]),
            bind_group: None,
            made_from: None,
        }
    }
}

fn solids_buffer(solids: &[SolidUniform]) -> StorageBuffer<Vec<SolidUniform>> {
    let list = if solids.is_empty() { vec![SolidUniform::NOTHING] } else { solids.to_vec() };
    let mut buffer = StorageBuffer::from(list);
    buffer.set_label(Some("mirrorball_probe_solids"));
    buffer
}

/// The cube as it was after the last dispatch.
struct History {
    cube: AssetId<Image>,
    texture: Texture,
    view: TextureView,
    /// When the newest picture in it was taken.
    captured: Duration,
}

/// Dispatches of this frame, and what they need.
#[derive(Resource, Default)]
struct PreparedUnwraps {
    due: Vec<(PictureKind, BindGroup)>,
    cube: Option<Texture>,
    history: Option<History>,
    sources: HashMap<Entity, PreparedSource>,
    share: f32,
}

fn prepare_unwraps(
    mut prepared: ResMut<PreparedUnwraps>,
    mut writes: ResMut<CubeWrites>,
    extracted: Res<ExtractedSources>,
    pipelines: Res<UnwrapPipelines>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let prepared = &mut *prepared;
    prepared.due.clear();
    prepared.sources.retain(|entity, _| extracted.sources.iter().any(|source| source.entity == *entity));
    let Some((cube_id, cube)) = extracted.cube.and_then(|id| Some((id, images.get(id)?))) else {
        return;
    };
    if prepared.history.as_ref().is_none_or(|history| history.cube != cube_id) {
        prepared.history = Some(History::new(&device, cube_id));
        prepared.sources.clear();
    }
    let Some(history) = &mut prepared.history else { return };
    let ready: Vec<&ExtractedSource> = extracted
        .sources
        .iter()
        .filter(|source| {
            let pipeline = pipelines.id(source.kind()).and_then(|id| pipeline_cache.get_compute_pipeline(id));
            pipeline.is_some() && images.get(source.picture).is_some()
        })
        .collect();
    let is_new = |source: &&ExtractedSource| {
        let made_from = prepared.sources.get(&source.entity).and_then(|known| known.made_from.as_ref());
        made_from.is_none_or(|(sequence, view)| *sequence != source.sequence || *view != source.view)
    };
    // What is measured replaces what was only assumed in steps, so that each step is the same part of the whole way.
    let has_measured = ready.iter().any(|source| !source.is_fallback());
    let target = match if has_measured { extracted.share } else { 0.0 } {
        small if small > prepared.share && small < 1.0 && small - prepared.share < LEAST_STEP => prepared.share,
        target => target,
    };
    let share = if target >= 1.0 { 1.0 } else { ((target - prepared.share) / (1.0 - prepared.share)).clamp(0.0, 1.0) };
    let is_fading = has_measured && target != prepared.share;
    if !ready.iter().any(is_new) && !is_fading {
        return;
    }
    prepared.share = target;
    let captured = ready.iter().map(|source| source.captured).max().unwrap_or_default();
    let elapsed = captured.abs_diff(history.captured).as_secs_f32();
    let mut is_first = true;
    for source in ready {
        let known = prepared.sources.entry(source.entity).or_default();
        let is_news = known.made_from.as_ref().is_none_or(|(sequence, _)| *sequence != source.sequence);
        let mut uniform = source.uniform();
        if !source.is_fallback() {
            uniform.share = share;
            if is_first {
                let change = if is_news { source.change } else { 0.0 };
                uniform.history_keep = (-elapsed / MEMORY_SECONDS - CHANGE_FORGETS * change).exp();
                uniform.history_is_old = 1.0;
            }
            if !is_first || !is_news {
                uniform.history_scale = Vec3::ONE;
            }
            is_first = false;
        }
        known.uniform.set(uniform);
        if let SourceView::Ball(_, gains, around) = &source.view {
            if let Some(gains) = gains {
                known.gains.get_mut().copy_from_slice(&gains.0);
            }
            for (buffer, solids) in [(&mut known.blockers, &around.blockers), (&mut known.shown, &around.shown)] {
                // Shaders take a buffer's length for the number of boxes.
                if buffer.get().len() != solids.len().max(1) {
                    *buffer = solids_buffer(solids);
                    known.bind_group = None;
                } else if !solids.is_empty() {
                    buffer.get_mut().copy_from_slice(solids);
                }
            }
        }
        known.uniform.write_buffer(&device, &queue);
        for buffer in [&mut known.blockers, &mut known.shown] {
            buffer.write_buffer(&device, &queue);
        }
        known.gains.write_buffer(&device, &queue);
        let Some(frame) = images.get(source.picture) else { continue };
        let views = [frame.texture_view.id(), cube.texture_view.id()];
        if known.bind_group.as_ref().is_none_or(|(of, _)| *of != views) {
            let (Some(uniform), Some(gains), Some(blockers), Some(shown)) =
                (known.uniform.binding(), known.gains.binding(), known.blockers.binding(), known.shown.binding())
            else {
                continue;
            };
            let bind_group = device.create_bind_group(
                "mirrorball_probe_unwrap_bind_group",
                &pipeline_cache.get_bind_group_layout(&pipelines.layout),
                &BindGroupEntries::sequential((
                    &frame.texture_view,
                    uniform,
                    gains,
                    blockers,
                    shown,
                    &history.view,
                    &cube_faces(&cube.texture),
                )),
            );
            known.bind_group = Some((views, bind_group));
        }
        let Some((_, bind_group)) = &known.bind_group else { continue };
        prepared.due.push((source.kind(), bind_group.clone()));
        known.made_from = Some((source.sequence, source.view.clone()));
    }
    history.captured = captured;
    prepared.cube = Some(cube.texture.clone());
    writes.announce(cube_id);
}

impl History {
    fn new(device: &RenderDevice, cube: AssetId<Image>) -> Self {
        let texture = device.create_texture(&TextureDescriptor {
            label: Some("mirrorball_probe_history"),
            size: Self::EXTENT,
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D2,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&TextureViewDescriptor {
            label: Some("mirrorball_probe_history_view"),
            dimension: Some(TextureViewDimension::D2Array),
            ..default()
        });
        Self { cube, texture, view, captured: Duration::ZERO }
    }

    const EXTENT: Extent3d =
        Extent3d { width: EnvironmentCube::SIZE, height: EnvironmentCube::SIZE, depth_or_array_layers: 6 };
}

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;

fn unwrap_pass(
    pipelines: Option<Res<UnwrapPipelines>>,
    prepared: Res<PreparedUnwraps>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let (Some(pipelines), Some(cube), Some(history)) = (pipelines, &prepared.cube, &prepared.history) else {
        return;
    };
    for (kind, bind_group) in &prepared.due {
        let Some(pipeline) = pipelines.id(*kind).and_then(|id| pipeline_cache.get_compute_pipeline(id)) else {
            continue;
        };
        let diagnostics = ctx.diagnostic_recorder();
        let diagnostics = diagnostics.as_deref();
        let encoder = ctx.command_encoder();
        let mut pass = encoder.begin_compute_pass(&ComputePassDescriptor {
            label: Some("mirrorball_probe_unwrap_pass"),
            timestamp_writes: None,
        });
        let span = diagnostics.pass_span(&mut pass, "mirrorball_probe_unwrap");
        pass.set_pipeline(pipeline);
        let groups = EnvironmentCube::SIZE.div_ceil(WORKGROUP);
        pass.set_bind_group(0, bind_group, &[]);
        pass.dispatch_workgroups(groups, groups, 6);
        span.end(&mut pass);
        drop(pass);
        encoder.copy_texture_to_texture(cube.as_image_copy(), history.texture.as_image_copy(), History::EXTENT);
    }
}
