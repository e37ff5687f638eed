//! Draws casters into the tiles of all directions: one pass, one instanced draw per mesh.

use super::{Caster, extract::ExtractedDome, textures::DomeTextures};
use bevy::{
    asset::{embedded_asset, load_embedded_asset},
    core_pipeline::schedule::camera_driver,
    mesh::{Mesh, MeshVertexBufferLayoutRef, PrimitiveTopology},
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        mesh::{RenderMesh, RenderMeshBufferInfo, allocator::MeshAllocator},
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId,
            CompareFunction, DepthStencilState, FragmentState, LoadOp, Operations, PipelineCache, PrimitiveState,
            RenderPassDepthStencilAttachment, RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages, ShaderType,
            SpecializedMeshPipeline, SpecializedMeshPipelineError, SpecializedMeshPipelines, StorageBuffer, StoreOp,
            TextureFormat, VertexState, binding_types::storage_buffer_read_only_sized,
        },
        renderer::{RenderContext, RenderDevice, RenderGraph, RenderGraphSystems, RenderQueue},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
};

pub(super) fn build(app: &mut App) {
    embedded_asset!(app, "depth_pass.wgsl");
    let Some(render_app) = app.get_sub_app_mut(RenderApp) else {
        return;
    };
    render_app
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
    kind: u32,
}

impl From<&Caster> for CasterUniform {
    fn from(caster: &Caster) -> Self {
        Self { world_from_local: caster.world_from_local, kind: caster.is_phantom.into() }
    }
}

#[derive(Resource)]
struct DepthPipeline {
    layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
}

fn init_depth_pipeline(mut commands: Commands, asset_server: Res<AssetServer>) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX,
            (storage_buffer_read_only_sized(false, None), storage_buffer_read_only_sized(false, None)),
        ),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "depth_pass.wgsl");
    commands.insert_resource(DepthPipeline { layout, shader });
}

impl SpecializedMeshPipeline for DepthPipeline {
    type Key = ();

    fn specialize(
        &self,
        (): (),
        layout: &MeshVertexBufferLayoutRef,
    ) -> Result<RenderPipelineDescriptor, SpecializedMeshPipelineError> {
        let positions = layout.0.get_layout(&[Mesh::ATTRIBUTE_POSITION.at_shader_location(0)])?;
        Ok(RenderPipelineDescriptor {
            label: Some("mirrorball_shadows_depth".into()),
            layout: vec![self.layout.clone()],
            vertex: VertexState { shader: self.shader.clone(), buffers: vec![positions], ..default() },
            // Both sides cast: sheets of one layer are common among stand-ins.
            primitive: PrimitiveState { cull_mode: None, ..default() },
            depth_stencil: Some(DepthStencilState {
                format: TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(CompareFunction::GreaterEqual),
                stencil: default(),
                bias: default(),
            }),
            fragment: Some(FragmentState { shader: self.shader.clone(), targets: vec![], ..default() }),
            ..default()
        })
    }
}

/// One caster's draw call; `slot` is its place in the buffer of casters.
struct CasterDraw {
    slot: u32,
    mesh: AssetId<Mesh>,
    pipeline: CachedRenderPipelineId,
}

/// What to draw this frame, and what is in the atlas already.
#[derive(Resource, Default)]
struct PreparedDepth {
    bind_group: Option<BindGroup>,
    draws: Vec<CasterDraw>,
    drawn: Option<(super::FittedDome, AssetId<Image>)>,
}

fn prepare_depth(
    mut prepared: ResMut<PreparedDepth>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    pipeline: Res<DepthPipeline>,
    mut pipelines: ResMut<SpecializedMeshPipelines<DepthPipeline>>,
    pipeline_cache: Res<PipelineCache>,
    meshes: Res<RenderAssets<RenderMesh>>,
    buffers: Res<RenderAssets<GpuShaderBuffer>>,
    device: Res<RenderDevice>,
    queue: Res<RenderQueue>,
) {
    prepared.bind_group = None;
    let Some(textures) = textures else {
        return;
    };
    let is_drawn =
        prepared.drawn.as_ref().is_some_and(|(fitted, atlas)| *fitted == dome.fitted && *atlas == textures.atlas.id());
    let casters = &dome.fitted.casters;
    if is_drawn || casters.is_empty() || textures.layout.directions != dome.fitted.directions {
        return;
    }
    let Some(views) = buffers.get(&textures.views) else {
        return;
    };
    prepared.draws.clear();
    for (slot, caster) in (0u32..).zip(casters) {
        let Some(mesh) = meshes.get(caster.mesh) else {
            return;
        };
        if mesh.primitive_topology() != PrimitiveTopology::TriangleList {
            warn_once!(
                "only meshes of triangle lists cast dome shadows; one of {:?} does not",
                mesh.primitive_topology()
            );
            continue;
        }
        match pipelines.specialize(&pipeline_cache, &pipeline, (), &mesh.layout) {
            Ok(pipeline) => prepared.draws.push(CasterDraw { slot, mesh: caster.mesh, pipeline }),
            Err(error) => error_once!("a mesh cannot cast dome shadows: {error}"),
        }
    }
    let uniforms: Vec<CasterUniform> = casters.iter().map(Into::into).collect();
    let mut buffer = StorageBuffer::from(uniforms);
    buffer.set_label(Some("mirrorball_shadows_casters"));
    buffer.write_buffer(&device, &queue);
    let Some(binding) = buffer.binding() else {
        return;
    };
    prepared.bind_group = Some(device.create_bind_group(
        "mirrorball_shadows_depth_bind_group",
        &pipeline_cache.get_bind_group_layout(&pipeline.layout),
        &BindGroupEntries::sequential((views.buffer.as_entire_binding(), binding)),
    ));
}

fn depth_pass(
    mut prepared: ResMut<PreparedDepth>,
    dome: Res<ExtractedDome>,
    textures: Option<Res<DomeTextures>>,
    pipeline_cache: Res<PipelineCache>,
    images: Res<RenderAssets<GpuImage>>,
    meshes: Res<RenderAssets<RenderMesh>>,
    allocator: Res<MeshAllocator>,
    mut ctx: RenderContext,
) {
    let (Some(textures), Some(bind_group)) = (textures, prepared.bind_group.take()) else {
        return;
    };
    let Some(atlas) = images.get(&textures.atlas) else {
        return;
    };
    if prepared.draws.iter().any(|draw| pipeline_cache.get_render_pipeline(draw.pipeline).is_none()) {
        return;
    }
    let diagnostics = ctx.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = ctx.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("mirrorball_shadows_depth_pass"),
        color_attachments: &[],
        depth_stencil_attachment: Some(RenderPassDepthStencilAttachment {
            view: &atlas.texture_view,
            depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
            stencil_ops: None,
        }),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "mirrorball_shadows_depth");
    let directions = dome.fitted.directions;
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
    prepared.drawn = Some((dome.fitted.clone(), textures.atlas.id()));
}
