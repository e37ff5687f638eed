//! Pipelines that draw casters into the depth atlas, and the one that clears tiles.

use bevy::{
    asset::load_embedded_asset,
    ecs::system::SystemParam,
    mesh::{Mesh, MeshVertexAttribute, MeshVertexBufferLayoutRef},
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, CachedRenderPipelineId, CompareFunction, DepthStencilState,
        FragmentState, PipelineCache, PrimitiveState, RenderPipelineDescriptor, SamplerBindingType, ShaderStages,
        SpecializedMeshPipeline, SpecializedMeshPipelineError, SpecializedMeshPipelines, TextureFormat,
        TextureSampleType, VertexState,
        binding_types::{sampler, storage_buffer_read_only_sized, texture_2d},
    },
    shader::ShaderDefVal,
};

const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// The properties of a caster's mesh on which its pipeline depends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(in crate::shadows) struct DepthPipelineKey {
    pub(in crate::shadows) is_skinned: bool,
    pub(in crate::shadows) is_morphed: bool,
    pub(in crate::shadows) is_alpha_masked: bool,
    pub(in crate::shadows) uses_second_uv: bool,
}

/// Returns the mesh's set of texture coordinates that a mask uses.
pub(in crate::shadows) fn uv_attribute(uses_second_uv: bool) -> MeshVertexAttribute {
    if uses_second_uv { Mesh::ATTRIBUTE_UV_1 } else { Mesh::ATTRIBUTE_UV_0 }
}

/// Layouts and shader of all depth pipelines.
#[derive(Resource, Clone)]
pub(in crate::shadows) struct DepthPipeline {
    pub(in crate::shadows) layout: BindGroupLayoutDescriptor,
    pub(in crate::shadows) morph_layout: BindGroupLayoutDescriptor,
    pub(in crate::shadows) mask_layout: BindGroupLayoutDescriptor,
    shader: Handle<Shader>,
    pub(in crate::shadows) clear: CachedRenderPipelineId,
}

/// Access to the pipelines of all kinds of casters.
#[derive(SystemParam)]
pub(super) struct DepthPipelines<'w> {
    pub(in crate::shadows) shared: Res<'w, DepthPipeline>,
    pub(super) specialized: ResMut<'w, SpecializedMeshPipelines<DepthPipeline>>,
}

fn depth_state(compare: CompareFunction) -> Option<DepthStencilState> {
    Some(DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        depth_compare: Some(compare),
        stencil: default(),
        bias: default(),
    })
}

pub(in crate::shadows) fn init_depth_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let buffer = || storage_buffer_read_only_sized(false, None);
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_layout",
        &BindGroupLayoutEntries::sequential(ShaderStages::VERTEX, (buffer(), buffer(), buffer(), buffer(), buffer())),
    );
    let morph_layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_depth_morph_layout",
        &BindGroupLayoutEntries::single(ShaderStages::VERTEX, buffer()),
    );
    let mask_layout = BindGroupLayoutDescriptor::new(
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
    commands.insert_resource(DepthPipeline { layout, morph_layout, mask_layout, shader, clear });
}

impl SpecializedMeshPipeline for DepthPipeline {
    type Key = DepthPipelineKey;

    fn specialize(
        &self,
        key: DepthPipelineKey,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Result<RenderPipelineDescriptor, SpecializedMeshPipelineError> {
        let mut attributes = vec![Mesh::ATTRIBUTE_POSITION.at_shader_location(0)];
        let mut groups = vec![self.layout.clone()];
        let mut shader_defs: Vec<ShaderDefVal> = vec![];
        if key.is_skinned {
            shader_defs.push("SKINNED".into());
            attributes.push(Mesh::ATTRIBUTE_JOINT_INDEX.at_shader_location(1));
            attributes.push(Mesh::ATTRIBUTE_JOINT_WEIGHT.at_shader_location(2));
        }
        if key.is_morphed {
            shader_defs.push("MORPHED".into());
            groups.push(self.morph_layout.clone());
        }
        if key.is_alpha_masked {
            attributes.push(uv_attribute(key.uses_second_uv).at_shader_location(3));
            shader_defs.extend(["CUT_OUT".into(), ShaderDefVal::UInt("CUTOUT_GROUP".into(), groups.len() as u32)]);
            groups.push(self.mask_layout.clone());
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
            // Both sides cast, because stand-ins for real things are often sheets of one layer.
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
