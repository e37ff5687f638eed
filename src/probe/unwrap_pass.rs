//! Camera picture of a mirrored ball → environment cube, one compute dispatch before all cameras.

use super::{
    CubeWrites, EnvironmentCube, ProbeMeasurement,
    measure::ProbeView,
    recovery::{self, MOST_SATURATION, WHITE_FROM},
};
use crate::{MirrorballPasses, camera::FrameTexture};
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
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, PipelineCache, ShaderStages, ShaderType, StorageBuffer,
            StorageTextureAccess, TextureFormat, TextureSampleType, TextureViewDescriptor, TextureViewDimension,
            UniformBuffer,
            binding_types::{storage_buffer_read_only, texture_2d, texture_storage_2d_array, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        texture::GpuImage,
    },
    shader::load_shader_library,
};
use std::sync::Arc;

/// Gain on clipped light by direction, on the entity of a probe; replaces the one gain of its measurement.
#[derive(Component, Clone)]
pub(crate) struct ClipGains(pub(crate) Arc<Vec<Vec4>>);

impl ClipGains {
    /// Cells along an edge of the cube of gains, in the order of [`cube_directions`](super::cube_directions); as in the shader.
    pub(crate) const EDGE: u32 = 32;
    /// Number of gains.
    pub(crate) const COUNT: usize = 6 * (Self::EDGE * Self::EDGE) as usize;
}

/// A list is never changed in place: the same list is equal, another one is news.
impl PartialEq for ClipGains {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

pub(super) fn build(app: &mut App) {
    load_shader_library!(app, "mirror_ball.wgsl");
    embedded_asset!(app, "unwrap_pass.wgsl");
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        warn!("ProbePlugin: no renderer, environments will not be measured");
        return;
    };
    render_app
        .init_resource::<ExtractedProbes>()
        .init_resource::<PreparedUnwraps>()
        .init_resource::<CubeWrites>()
        .add_systems(RenderStartup, init_unwrap_pipeline)
        .add_systems(ExtractSchedule, extract_probes)
        .add_systems(Render, prepare_unwraps.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            RenderGraph,
            unwrap_pass.in_set(RenderGraphSystems::Render).in_set(MirrorballPasses::WriteCubes).before(camera_driver),
        );
}

/// Mirror of `Ball` in `mirror_ball.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct BallUniform {
    center_camera: Vec3,
    radius: f32,
    edge_angle: f32,
    reflectance: f32,
}

/// Mirror of `Unwrap` in `unwrap_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct UnwrapUniform {
    ball: BallUniform,
    camera_from_world: Mat3,
    focal: Vec2,
    center: Vec2,
    gain: Vec4,
    up_camera: Vec3,
    most_saturation: f32,
    white_from: f32,
    uniform_radiance: Vec3,
    clipped_from: f32,
    gains_by_direction: f32,
}

impl From<&ProbeView> for UnwrapUniform {
    fn from(view: &ProbeView) -> Self {
        Self {
            ball: BallUniform {
                center_camera: view.center_camera,
                radius: view.radius,
                edge_angle: view.edge_angle,
                reflectance: view.reflectance,
            },
            camera_from_world: view.camera_from_world,
            focal: view.focal,
            center: view.center,
            gain: view.gain.extend(if view.uniform_radiance.is_some() { 1.0 } else { 0.0 }),
            up_camera: view.up_camera,
            most_saturation: MOST_SATURATION,
            white_from: WHITE_FROM,
            uniform_radiance: view.uniform_radiance.unwrap_or_default(),
            clipped_from: recovery::clipped_from_linear(),
            gains_by_direction: 0.0,
        }
    }
}

#[derive(Resource, Default)]
struct ExtractedProbes(Vec<ExtractedProbe>);

struct ExtractedProbe {
    frame: AssetId<Image>,
    cube: AssetId<Image>,
    sequence: u64,
    view: ProbeView,
    gains: Option<ClipGains>,
}

fn extract_probes(
    mut extracted: ResMut<ExtractedProbes>,
    probes: Extract<Query<(&ProbeMeasurement, &EnvironmentCube, Option<&ClipGains>)>>,
    cameras: Extract<Query<&FrameTexture>>,
) {
    extracted.0.clear();
    extracted.0.extend(probes.iter().filter_map(|(measurement, cube, gains)| {
        let view = measurement.view?;
        let frame = cameras.get(view.camera).ok()?.image.id();
        Some(ExtractedProbe { frame, cube: cube.0.id(), sequence: measurement.sequence, view, gains: gains.cloned() })
    }));
}

#[derive(Resource)]
struct UnwrapPipeline {
    layout: BindGroupLayoutDescriptor,
    id: CachedComputePipelineId,
}

fn init_unwrap_pipeline(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_probe_unwrap_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::COMPUTE,
            (
                texture_2d(TextureSampleType::Float { filterable: true }),
                uniform_buffer::<UnwrapUniform>(false),
                storage_buffer_read_only::<Vec<Vec4>>(false),
                texture_storage_2d_array(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly),
            ),
        ),
    );
    let id = pipeline_cache.queue_compute_pipeline(ComputePipelineDescriptor {
        label: Some("mirrorball_probe_unwrap_pipeline".into()),
        layout: vec![layout.clone()],
        shader: load_embedded_asset!(asset_server.as_ref(), "unwrap_pass.wgsl"),
        entry_point: Some("unwrap_ball".into()),
        ..default()
    });
    commands.insert_resource(UnwrapPipeline { layout, id });
}

/// Bind groups of the cubes that have to be rewritten this frame, and what each cube was last made from.
#[derive(Resource, Default)]
struct PreparedUnwraps {
    due: Vec<BindGroup>,
    made_from: HashMap<AssetId<Image>, (u64, ProbeView, Option<ClipGains>)>,
    gain_lists: HashMap<AssetId<Image>, StorageBuffer<Vec<Vec4>>>,
}

fn prepare_unwraps(
    mut prepared: ResMut<PreparedUnwraps>,
    mut writes: ResMut<CubeWrites>,
    probes: Res<ExtractedProbes>,
    pipeline: Res<UnwrapPipeline>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    let prepared = &mut *prepared;
    prepared.due.clear();
    prepared.gain_lists.retain(|id, _| probes.0.iter().any(|probe| probe.cube == *id));
    prepared.made_from.retain(|id, _| probes.0.iter().any(|probe| probe.cube == *id));
    if pipeline_cache.get_compute_pipeline(pipeline.id).is_none() {
        return;
    }
    for probe in &probes.0 {
        let gains = probe.gains.clone().filter(|gains| gains.0.len() == ClipGains::COUNT);
        let made_from = (probe.sequence, probe.view, gains.clone());
        if prepared.made_from.get(&probe.cube) == Some(&made_from) {
            continue;
        }
        let (Some(frame), Some(cube)) = (images.get(probe.frame), images.get(probe.cube)) else {
            continue;
        };
        let mut uniform = UnwrapUniform::from(&probe.view);
        uniform.gains_by_direction = if gains.is_some() { 1.0 } else { 0.0 };
        let mut uniform = UniformBuffer::from(uniform);
        uniform.set_label(Some("mirrorball_probe_unwrap_uniform"));
        uniform.write_buffer(&device, &queue);
        let gain_list = prepared.gain_lists.entry(probe.cube).or_insert_with(|| {
            let mut list = StorageBuffer::from(vec![Vec4::ONE; ClipGains::COUNT]);
            list.set_label(Some("mirrorball_probe_clip_gains"));
            list
        });
        if let Some(gains) = gains {
            gain_list.get_mut().copy_from_slice(&gains.0);
        }
        gain_list.write_buffer(&device, &queue);
        let (Some(uniform), Some(gain_list)) = (uniform.binding(), gain_list.binding()) else {
            continue;
        };
        let faces = cube.texture.create_view(&TextureViewDescriptor {
            label: Some("mirrorball_probe_cube_faces"),
            dimension: Some(TextureViewDimension::D2Array),
            ..default()
        });
        prepared.due.push(device.create_bind_group(
            "mirrorball_probe_unwrap_bind_group",
            &pipeline_cache.get_bind_group_layout(&pipeline.layout),
            &BindGroupEntries::sequential((&frame.texture_view, uniform, gain_list, &faces)),
        ));
        prepared.made_from.insert(probe.cube, made_from);
        writes.announce(probe.cube);
    }
}

/// Threads along each side of a workgroup, as in the shader.
const WORKGROUP: u32 = 8;

fn unwrap_pass(
    pipeline: Option<Res<UnwrapPipeline>>,
    prepared: Res<PreparedUnwraps>,
    pipeline_cache: Res<PipelineCache>,
    mut ctx: RenderContext,
) {
    let Some(pipeline) = pipeline.and_then(|p| pipeline_cache.get_compute_pipeline(p.id)) else {
        return;
    };
    if prepared.due.is_empty() {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.command_encoder().begin_compute_pass(&ComputePassDescriptor {
        label: Some("mirrorball_probe_unwrap_pass"),
        timestamp_writes: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_probe_unwrap");
    pass.set_pipeline(pipeline);
    let groups = EnvironmentCube::SIZE.div_ceil(WORKGROUP);
    for bind_group in &prepared.due {
        pass.set_bind_group(0, bind_group, &[]);
        pass.dispatch_workgroups(groups, groups, 6);
    }
    span.end(&mut pass);
}
