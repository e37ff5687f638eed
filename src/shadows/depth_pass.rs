//! Draws casters into the tiles of all directions: one pass, one instanced draw per mesh.

use super::{
    Caster,
    extract::{DomeViews, ExtractedDome},
    textures::DomeTextures,
};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    mesh::{Mesh, MeshVertexAttribute, MeshVertexBufferLayoutRef, PrimitiveTopology},
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, RenderMeshBufferInfo, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
            CompareFunction, DepthStencilState, FragmentState, LoadOp, Operations, PipelineCache, PrimitiveState,
            RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipelineDescriptor, SamplerBindingType,
            ShaderSize, ShaderStages, ShaderType, SpecializedMeshPipeline, SpecializedMeshPipelineError,
            SpecializedMeshPipelines, StorageBuffer, StoreOp, TextureFormat, TextureSampleType, VertexState,
            binding_types::{sampler, storage_buffer_read_only_sized, texture_2d},
            encase::internal::WriteInto,
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
    shader::ShaderDefVal,
};
use std::ops::Range;

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "depth_pass.wgsl");
    app.sub_app_mut(RenderApp)
        .init_resource::<SpecializedMeshPipelines<DepthPipeline>>()
        .init_resource::<PreparedDepth>()
        .add_systems(RenderStartup, init_depth_pipeline)
        .add_systems(Render, prepare_depth.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(RenderGraph, depth_pass.in_set(RenderGraphSystems::Render).before(camera_driver));
}

/// Mirror of `Caster` in `depth_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
struct CasterUniform {
    world_from_local: Mat4,
    uv_x: Vec4,
    uv_y: Vec4,
    kind: u32,
    first_joint: u32,
    first_morph_weight: u32,
    morph_targets: u32,
    first_vertex: u32,
    vertex_count: u32,
    first_morph_displacement: u32,
    cutoff: f32,
}

/// What of a mesh makes its pipeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct CasterKind {
    is_skinned: bool,
    is_morphed: bool,
    is_cut_out: bool,
    uses_second_uv: bool,
}

#[derive(Resource)]
pub(super) struct DepthPipeline {
    layout: BindGroupLayoutDescriptor,
    morph_layout: BindGroupLayoutDescriptor,
    cutout_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    clear: CachedRenderPipelineId,
}

const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

fn depth_state(compare: CompareFunction) -> Option<DepthStencilState> {
    Some(DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: default(),
        bias: default(),
    })
}

fn init_depth_pipeline(mut commands: Commands, asset_server: Res<AssetServer>, pipeline_cache: Res<PipelineCache>) {
    let buffer = || storage_buffer_read_only_sized(false, None);
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_layout",
        &BindGroupLayoutEntries::sequential(ShaderStages::VERTEX, (buffer(), buffer(), buffer(), buffer(), buffer())),
    );
    let morph_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_morph_layout",
        &BindGroupLayoutEntries::single(ShaderStages::VERTEX, buffer()),
    );
    let cutout_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_cutout_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (texture_2d(TextureSampleType::Float { filterable: true }), sampler(SamplerBindingType::Filtering)),
        ),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "depth_pass.wgsl");
    let clear = pipeline_cache.queue_render_pipeline(RenderPipelineDescriptor {
        label: Some("mirrorball_shadows_clear".into()),
        layout: vec![layout.clone()],
        vertex: VertexState { shader: shader.clone(), entry_point: Some("clear".into()), ..default() },
        depth_stencil: depth_state(CompareFunction::Always),
        ..default()
    });
    commands.insert_resource(DepthPipeline { layout, morph_layout, cutout_layout, shader, clear });
}

impl SpecializedMeshPipeline for DepthPipeline {
    type Key = CasterKind;

    fn specialize(
        &self,
        kind: CasterKind,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Result<RenderPipelineDescriptor, SpecializedMeshPipelineError> {
        let mut attributes = vec![Mesh::ATTRIBUTE_POSITION.at_shader_location(0)];
        let mut groups = vec![self.layout.clone()];
        let mut shader_defs: Vec<ShaderDefVal> = vec![];
        if kind.is_skinned {
            shader_defs.push("SKINNED".into());
            attributes.push(Mesh::ATTRIBUTE_JOINT_INDEX.at_shader_location(1));
            attributes.push(Mesh::ATTRIBUTE_JOINT_WEIGHT.at_shader_location(2));
        }
        if kind.is_morphed {
            shader_defs.push("MORPHED".into());
            groups.push(self.morph_layout.clone());
        }
        if kind.is_cut_out {
            let uv = if kind.uses_second_uv { Mesh::ATTRIBUTE_UV_1 } else { Mesh::ATTRIBUTE_UV_0 };
            attributes.push(uv.at_shader_location(3));
            shader_defs.extend(["CUT_OUT".into(), ShaderDefVal::UInt("CUTOUT_GROUP".into(), groups.len() as u32)]);
            groups.push(self.cutout_layout.clone());
        }
        let buffers = vec![layout.0.get_layout(&attributes)?];
        Ok(RenderPipelineDescriptor {
            label: Some("mirrorball_shadows_depth".into()),
            layout: groups,
            vertex: VertexState {
                shader: self.shader.clone(),
                shader_defs: shader_defs.clone(),
                entry_point: Some("vertex".into()),
                buffers,
            },
            // Both sides cast: sheets of one layer are common among stand-ins.
            primitive: PrimitiveState { cull_mode: None, ..default() },
            depth_stencil: depth_state(CompareFunction::GreaterEqual),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs,
                entry_point: Some("fragment".into()),
                targets: vec![],
            }),
            ..default()
        })
    }
}

/// One caster's draw call; `slot` is its place in the buffer of casters.
struct CasterDraw {
    slot: u32,
    mesh: AssetId<Mesh>,
    pipeline: CachedRenderPipelineId,
    /// Morph displacements, then the texture that cuts out, as far as the pipeline has them.
    bind_groups: Vec<BindGroup>,
}

/// What to draw this frame.
#[derive(Resource, Default)]
pub(super) struct PreparedDepth {
    bind_group: Option<BindGroup>,
    draws: Vec<CasterDraw>,
    /// Number of directions that are drawn.
    directions: u32,
    /// The layers of the atlas hold nothing that is to be kept.
    is_whole: bool,
}

/// Everything of all casters that the vertex shader reads.
#[derive(Default)]
struct CasterBuffers {
    casters: Vec<CasterUniform>,
    joints: Vec<Mat4>,
    morph_weights: Vec<f32>,
}

impl CasterBuffers {
    /// Adds a caster; `vertices` and `displacements` are the places of its mesh in Bevy's buffers.
    fn push(
        &mut self,
        caster: &Caster,
        kind: CasterKind,
        vertices: Range<u32>,
        displacements: Option<Range<u32>>,
    ) -> u32 {
        let uv = caster.cutout.as_ref().map_or(Mat3::IDENTITY, |cutout| cutout.uv_transform.into()).transpose();
        self.casters.push(CasterUniform {
            world_from_local: caster.world_from_local,
            uv_x: uv.x_axis.extend(0.0),
            uv_y: uv.y_axis.extend(0.0),
            kind: caster.is_phantom.into(),
            first_joint: self.joints.len() as u32,
            first_morph_weight: self.morph_weights.len() as u32,
            morph_targets: if kind.is_morphed { caster.morph_weights.len() as u32 } else { 0 },
            first_vertex: vertices.start,
            vertex_count: vertices.end - vertices.start,
            first_morph_displacement: displacements.map_or(0, |range| range.start),
            cutoff: caster.cutout.as_ref().map_or(0.0, |cutout| cutout.cutoff / cutout.alpha.max(1e-6)),
        });
        self.joints.extend(&caster.joints);
        self.morph_weights.extend(&caster.morph_weights);
        self.casters.len() as u32 - 1
    }
}

pub(super) fn filled_buffer<T: ShaderSize + WriteInto>(
    label: &'static str,
    mut values: Vec<T>,
    filler: T,
    device: &RenderDevice,
    queue: &RenderQueue,
) -> StorageBuffer<Vec<T>> {
    // An empty buffer cannot be bound.
    if values.is_empty() {
        values.push(filler);
    }
    let mut buffer = StorageBuffer::from(values);
    buffer.set_label(Some(label));
    buffer.write_buffer(device, queue);
    buffer
}

pub(super) fn prepare_depth(
    mut prepared: ResMut<PreparedDepth>,
    mut dome: ResMut<ExtractedDome>,
    mut views: ResMut<DomeViews>,
    textures: Option<Res<DomeTextures>>,
    pipeline: Res<DepthPipeline>,
    mut pipelines: ResMut<SpecializedMeshPipelines<DepthPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    meshes: Res<RenderAssets<RenderMesh>>,
    images: Res<RenderAssets<GpuImage>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    allocator: Res<MeshAllocator>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    prepared.bind_group = None;
    let Some(textures) = textures else {
        return;
    };
    if dome.pending.is_empty() || !dome.fitted.fits(&textures.layout) {
        return;
    }
    let (Some(view_buffer), Some(_)) = (buffers.get(&textures.views), images.get(&textures.atlas)) else {
        return;
    };
    prepared.draws.clear();
    let mut all = CasterBuffers::default();
    for caster in &dome.fitted.casters {
        let (Some(mesh), Some(vertices)) = (meshes.get(caster.mesh), allocator.mesh_vertex_slice(&caster.mesh)) else {
            return;
        };
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            warn_once!(
                "only meshes of triangle lists cast dome shadows; one of {:?} does not",
                mesh.primitive_topology()
            );
            continue;
        }
        let has = |attribute: MeshVertexAttribute| mesh.layout.0.contains(attribute);
        let displacements =
            allocator.mesh_morph_target_slice(&caster.mesh).filter(|_| !caster.morph_weights.is_empty());
        let cutout = caster.cutout.as_ref().and_then(|cutout| {
            let uv = if cutout.uses_second_uv { Mesh::ATTRIBUTE_UV_1 } else { Mesh::ATTRIBUTE_UV_0 };
            has(uv).then_some(cutout)
        });
        let texture = match cutout.map(|cutout| images.get(&cutout.texture)) {
            // Its texture is still loading.
            Some(None) => return,
            Some(texture) => texture,
            None => None,
        };
        let kind = CasterKind {
            is_skinned: !caster.joints.is_empty()
                && has(Mesh::ATTRIBUTE_JOINT_INDEX)
                && has(Mesh::ATTRIBUTE_JOINT_WEIGHT),
            is_morphed: displacements.is_some(),
            is_cut_out: texture.is_some(),
            uses_second_uv: cutout.is_some_and(|cutout| cutout.uses_second_uv),
        };
        let bound_displacements = displacements.as_ref().map(|slice| {
            device.create_bind_group(
                "mirrorball_shadows_depth_morph_bind_group",
                &pipeline_cache.get_bind_group_layout(&pipeline.morph_layout),
                &BindGroupEntries::single(slice.buffer.as_entire_binding()),
            )
        });
        let bound_cutout = texture.map(|texture| {
            device.create_bind_group(
                "mirrorball_shadows_depth_cutout_bind_group",
                &pipeline_cache.get_bind_group_layout(&pipeline.cutout_layout),
                &BindGroupEntries::sequential((&texture.texture_view, &texture.sampler)),
            )
        });
        match pipelines.specialize(&pipeline_cache, &pipeline, kind, &mesh.layout) {
            Ok(pipeline) => {
                let displacements = displacements.map(|slice| slice.range);
                prepared.draws.push(CasterDraw {
                    slot: all.push(caster, kind, vertices.range, displacements),
                    mesh: caster.mesh,
                    pipeline,
                    bind_groups: bound_displacements.into_iter().chain(bound_cutout).collect(),
                });
            }
            Err(error) => error_once!("a mesh cannot cast dome shadows: {error}"),
        }
    }
    let is_compiled = |id| pipeline_cache.get_render_pipeline(id).is_some();
    if !is_compiled(pipeline.clear) || !prepared.draws.iter().all(|draw| is_compiled(draw.pipeline)) {
        return;
    }
    let refreshed: Vec<u32> = std::iter::once(dome.pending.len() as u32).chain(dome.pending.iter().copied()).collect();
    let none = CasterUniform {
        world_from_local: Mat4::ZERO,
        uv_x: Vec4::ZERO,
        uv_y: Vec4::ZERO,
        kind: 0,
        first_joint: 0,
        first_morph_weight: 0,
        morph_targets: 0,
        first_vertex: 0,
        vertex_count: 0,
        first_morph_displacement: 0,
        cutoff: 0.0,
    };
    let casters = filled_buffer("mirrorball_shadows_casters", all.casters, none, &device, &queue);
    let refreshed = filled_buffer("mirrorball_shadows_refreshed", refreshed, 0, &device, &queue);
    let joints = filled_buffer("mirrorball_shadows_joints", all.joints, Mat4::ZERO, &device, &queue);
    let morph_weights = filled_buffer("mirrorball_shadows_morph_weights", all.morph_weights, 0.0, &device, &queue);
    let (Some(casters), Some(refreshed), Some(joints), Some(morph_weights)) =
        (casters.binding(), refreshed.binding(), joints.binding(), morph_weights.binding())
    else {
        return;
    };
    prepared.bind_group = Some(device.create_bind_group(
        "mirrorball_shadows_depth_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipeline.layout),
        &BindGroupEntries::sequential((
            view_buffer.buffer.as_entire_binding(),
            casters,
            refreshed,
            joints,
            morph_weights,
        )),
    ));
    let pending = std::mem::take(&mut dome.pending);
    views.refit(&dome.fitted, &textures.layout, &pending);
    prepared.directions = pending.len() as u32;
    prepared.is_whole = prepared.directions == textures.layout.shadow_maps();
}

fn depth_pass(
    mut prepared: ResMut<PreparedDepth>,
    textures: Option<Res<DomeTextures>>,
    depth_pipeline: Res<DepthPipeline>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    mut ctx: RenderContext,
) {
    let (Some(textures), Some(bind_group)) = (textures, prepared.bind_group.take()) else {
        return;
    };
    let (Some(atlas), Some(clear)) =
        (images.get(&textures.atlas), pipeline_cache.get_render_pipeline(depth_pipeline.clear))
    else {
        return;
    };
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let load = if prepared.is_whole { LoadOp::Clear(0.0) } else { LoadOp::Load };
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_shadows_depth_pass"),
        color_attachments: &[],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &atlas.texture_view,
            depth_ops: Some(Operations { load, store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_depth");
    let directions = prepared.directions;
    if !prepared.is_whole {
        pass.set_render_pipeline(clear);
        pass.set_bind_group(0, &bind_group, &[]);
        pass.draw(0..6, 0..2 * directions);
    }
    for draw in &prepared.draws {
        let (Some(mesh), Some(pipeline), Some(vertices)) = (
            meshes.get(draw.mesh),
            pipeline_cache.get_render_pipeline(draw.pipeline),
            allocator.mesh_vertex_slice(&draw.mesh),
        ) else {
            continue;
        };
        pass.set_render_pipeline(pipeline);
        pass.set_bind_group(0, &bind_group, &[]);
        for (group, bound) in (1..).zip(&draw.bind_groups) {
            pass.set_bind_group(group, bound, &[]);
        }
        pass.set_vertex_buffer(0, vertices.buffer.slice(..));
        let instances = draw.slot * directions..(draw.slot + 1) * directions;
        match &mesh.buffer_info {
            RenderMeshBufferInfo::Indexed { index_format, count } => {
                if let Some(indices) = allocator.mesh_index_slice(&draw.mesh) {
                    let range = indices.range.start..indices.range.start + count;
                    pass.set_index_buffer(indices.buffer.slice(..), *index_format);
                    pass.draw_indexed(range, vertices.range.start as i32, instances);
                }
            }
            RenderMeshBufferInfo::NonIndexed => pass.draw(vertices.range.clone(), instances),
        }
    }
    span.end(&mut pass);
}
