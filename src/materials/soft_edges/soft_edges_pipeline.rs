//! Pipeline of the soft edges pass.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    prelude::*,
    render::{
        render_resource::{
            BindGroupLayoutDescriptor, BindGroupLayoutEntries, ColorTargetState, ColorWrites, FragmentState,
            RenderPipelineDescriptor, ShaderStages, ShaderType, SpecializedRenderPipeline, TextureFormat,
            TextureSampleType, VertexState,
            binding_types::{
                texture_2d, texture_2d_multisampled, texture_depth_2d, texture_depth_2d_multisampled, uniform_buffer,
            },
        },
        view::ViewUniform,
    },
};

/// Mirror of `SoftEdges` in `soft_edges_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct SoftEdgesUniform {
    pub(super) radius: f32,
}

#[derive(Resource)]
pub(super) struct SoftEdgesPipeline {
    single: BindGroupLayoutDescriptor,
    multisampled: BindGroupLayoutDescriptor,
    vertex: VertexState,
    shader: Handle<Shader>,
}

pub(super) fn init_soft_edges_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
) {
    let (color, normals) =
        (TextureSampleType::Float { filterable: true }, TextureSampleType::Float { filterable: false });
    let single = BindGroupLayoutEntries::sequential(
        ShaderStages::FRAGMENT,
        (
            uniform_buffer::<ViewUniform>(true),
            texture_2d(color),
            texture_depth_2d(),
            texture_2d(normals),
            uniform_buffer::<SoftEdgesUniform>(false),
        ),
    );
    let multisampled = BindGroupLayoutEntries::sequential(
        ShaderStages::FRAGMENT,
        (
            uniform_buffer::<ViewUniform>(true),
            texture_2d(color),
            texture_depth_2d_multisampled(),
            texture_2d_multisampled(normals),
            uniform_buffer::<SoftEdgesUniform>(false),
        ),
    );
    commands.insert_resource(SoftEdgesPipeline {
        single: BindGroupLayoutDescriptor::new("mirrorball_soft_edges_layout", &single),
        multisampled: BindGroupLayoutDescriptor::new("mirrorball_soft_edges_multisampled_layout", &multisampled),
        vertex: fullscreen_shader.to_vertex_state(),
        shader: load_embedded_asset!(asset_server.as_ref(), "soft_edges_pass.wgsl"),
    });
}

impl SoftEdgesPipeline {
    pub(super) fn layout(&self, is_multisampled: bool) -> &BindGroupLayoutDescriptor {
        if is_multisampled { &self.multisampled } else { &self.single }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct SoftEdgesPipelineKey {
    pub(super) target_format: TextureFormat,
    pub(super) is_multisampled: bool,
}

impl SpecializedRenderPipeline for SoftEdgesPipeline {
    type Key = SoftEdgesPipelineKey;

    fn specialize(&self, key: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("mirrorball_soft_edges".into()),
            layout: vec![self.layout(key.is_multisampled).clone()],
            vertex: self.vertex.clone(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: key.is_multisampled.then(|| "MULTISAMPLED".into()).into_iter().collect(),
                entry_point: Some("soften".into()),
                targets: vec![Some(ColorTargetState {
                    format: key.target_format,
                    blend: None,
                    write_mask: ColorWrites::ALL,
                })],
            }),
            ..default()
        }
    }
}
