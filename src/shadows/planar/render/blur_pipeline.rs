//! Pipelines that blur a mask and take a light's share of it away.

use super::mask_pipeline::MASK_FORMAT;
use bevy::{
    asset::load_embedded_asset,
    prelude::*,
    render::render_resource::{
        BindGroupLayoutDescriptor, BindGroupLayoutEntries, BlendComponent, BlendFactor, BlendOperation, BlendState,
        CachedRenderPipelineId, ColorTargetState, ColorWrites, FragmentState, PipelineCache, RenderPipelineDescriptor,
        ShaderStages, ShaderType, TextureFormat, TextureSampleType, VertexState,
        binding_types::{texture_2d, texture_2d_array, uniform_buffer},
    },
};

/// Mirror of `Blur` in `planar_blur_pass.wgsl`.
#[derive(ShaderType, Clone, Copy)]
pub(super) struct BlurUniform {
    pub(super) share: Vec3,
    pub(super) sigma_across: f32,
    pub(super) normal: Vec3,
    pub(super) sigma_down: f32,
    pub(super) strength: f32,
    pub(super) is_rest: u32,
}

#[derive(Resource)]
pub(super) struct BlurPipelines {
    pub(super) layout: BindGroupLayoutDescriptor,
    pub(super) blur_across: CachedRenderPipelineId,
    pub(super) take_share: CachedRenderPipelineId,
}

pub(super) fn init_blur_pipelines(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    pipeline_cache: Res<PipelineCache>,
) {
    let texture = || TextureSampleType::Float { filterable: false };
    let layout = BindGroupLayoutDescriptor::new(
        "mirrorball_shadows_planar_blur_layout",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::VERTEX_FRAGMENT,
            (texture_2d(texture()), uniform_buffer::<BlurUniform>(false), texture_2d_array(texture())),
        ),
    );
    let shader = load_embedded_asset!(asset_server.as_ref(), "planar_blur_pass.wgsl");
    let queue = |entry_point: &'static str, format, blend| {
        pipeline_cache.queue_render_pipeline(RenderPipelineDescriptor {
            label: Some(format!("mirrorball_shadows_planar_{entry_point}").into()),
            layout: vec![layout.clone()],
            vertex: VertexState { shader: shader.clone(), entry_point: Some("vertex".into()), ..default() },
            fragment: Some(FragmentState {
                shader: shader.clone(),
                entry_point: Some(entry_point.into()),
                targets: vec![Some(ColorTargetState { format, blend, write_mask: ColorWrites::ALL })],
                ..default()
            }),
            ..default()
        })
    };
    let subtract = BlendComponent {
        src_factor: BlendFactor::One,
        dst_factor: BlendFactor::One,
        operation: BlendOperation::ReverseSubtract,
    };
    let (blur_across, take_share) = (
        queue("blur_across", MASK_FORMAT, None),
        queue("take_share", TextureFormat::Rgba16Float, Some(BlendState { color: subtract, alpha: subtract })),
    );
    commands.insert_resource(BlurPipelines { layout, blur_across, take_share });
}
