//! Render pipeline that draws camera frames as backgrounds.

use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, BlendComponent, BlendFactor, BlendState, ColorTargetState,
        ColorWrites, FragmentState, MultisampleState, RenderPipelineDescriptor, SamplerBindingType, ShaderStages,
        ShaderType, SpecializedRenderPipeline, TextureFormat, TextureSampleType, VertexState,
        binding_types::{sampler, texture_2d, uniform_buffer},
    },
};

#[derive(ShaderType, Clone, Copy, PartialEq)]
pub(super) struct BackgroundUniform {
    pub(super) frame_uv_from_view_uv: Vec4,
}

#[derive(Resource)]
pub(super) struct BackgroundPipeline {
    pub(super) layout: BindGroupLayoutDescriptor,
    vertex: VertexState,
    shader: Handle<Shader>,
}

pub(super) fn init_background_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
) {
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_camera_background_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (
                texture_2d(TextureSampleType::Float { filterable: true }),
                sampler(SamplerBindingType::Filtering),
                uniform_buffer::<BackgroundUniform>(false),
            ),
        ),
    );
    commands.insert_resource(BackgroundPipeline {
        layout,
        vertex: fullscreen_shader.to_vertex_state(),
        shader: load_embedded_asset!(asset_server.as_ref(), "background_pass.wgsl"),
    });
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct BackgroundPipelineKey {
    pub(super) target_format: TextureFormat,
    pub(super) samples: u32,
    /// Whether alpha tells real from virtual, as [`MarksReal`](super::MarksReal) says.
    pub(super) marks_real: bool,
}

/// Writes the frame and keeps what is around it; alpha becomes 0 everywhere.
const MARKING: BlendState = BlendState {
    color: BlendComponent {
        src_factor: BlendFactor::One,
        dst_factor: BlendFactor::SrcAlpha,
        ..BlendComponent::REPLACE
    },
    alpha: BlendComponent { src_factor: BlendFactor::Zero, dst_factor: BlendFactor::Zero, ..BlendComponent::REPLACE },
};

impl SpecializedRenderPipeline for BackgroundPipeline {
    type Key = BackgroundPipelineKey;

    fn specialize(&self, key: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("mirrorball_camera_background".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex.clone(),
            multisample: MultisampleState { count: key.samples, ..default() },
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: key.marks_real.then(|| "MARKS_REAL".into()).into_iter().collect(),
                targets: vec![Some(ColorTargetState {
                    format: key.target_format,
                    blend: key.marks_real.then_some(MARKING),
                    write_mask: ColorWrites::ALL,
                })],
                ..default()
            }),
            ..default()
        }
    }
}
