//! Pipeline of the grain pass, and the texture with its noise.

use super::{
    noise_bands::BINS,
    noise_tile::{OCTAVES, TILE, texels},
};
use bevy::{
    asset::load_embedded_asset,
    core_pipeline::FullscreenShader,
    prelude::*,
    render::{
        render_resource::{
            BindGroupLayoutDescriptor, BindGroupLayoutEntries, ColorTargetState, ColorWrites, Extent3d, FragmentState,
            RenderPipelineDescriptor, ShaderStages, ShaderType, SpecializedRenderPipeline, TextureDataOrder,
            TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView,
            TextureViewDescriptor, TextureViewDimension, VertexState,
            binding_types::{texture_2d, texture_2d_array, uniform_buffer},
        },
        renderer::{RenderDevice, RenderQueue},
    },
    shader::ShaderDefVal,
};

/// Mirror of `Grain` in `grain_pass.wgsl`.
#[derive(ShaderType, Clone, Copy, PartialEq)]
pub(super) struct GrainUniform {
    pub(super) frame_px_from_view_px: Vec4,
    pub(super) viewport: IVec4,
    pub(super) offsets: [UVec4; OCTAVES],
    pub(super) levels: [Vec4; OCTAVES * BINS],
    pub(super) weights: [Vec4; 3],
}

#[derive(Resource)]
pub(super) struct GrainPipeline {
    pub(super) layout: BindGroupLayoutDescriptor,
    vertex: VertexState,
    shader: Handle<Shader>,
}

pub(super) fn init_grain_pipeline(
    mut commands: Commands,
    asset_server: Res<AssetServer>,
    fullscreen_shader: Res<FullscreenShader>,
) {
    let unfiltered = TextureSampleType::Float { filterable: false };
    let entries = BindGroupLayoutEntries::sequential(
        ShaderStages::FRAGMENT,
        (texture_2d(unfiltered), texture_2d_array(unfiltered), uniform_buffer::<GrainUniform>(false)),
    );
    commands.insert_resource(GrainPipeline {
        layout: BindGroupLayoutDescriptor::new("mirrorball_grain_layout", &entries),
        vertex: fullscreen_shader.to_vertex_state(),
        shader: load_embedded_asset!(asset_server.as_ref(), "grain_pass.wgsl"),
    });
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct GrainPipelineKey {
    pub(super) target_format: TextureFormat,
    /// Radius of the blur in pixels.
    pub(super) radius: u32,
}

impl SpecializedRenderPipeline for GrainPipeline {
    type Key = GrainPipelineKey;

    fn specialize(&self, key: Self::Key) -> RenderPipelineDescriptor {
        RenderPipelineDescriptor {
            label: Some("mirrorball_grain".into()),
            layout: vec![self.layout.clone()],
            vertex: self.vertex.clone(),
            fragment: Some(FragmentState {
                shader: self.shader.clone(),
                shader_defs: vec![ShaderDefVal::UInt("RADIUS".into(), key.radius)],
                entry_point: Some("add_grain".into()),
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

/// Uploads the tile of noise, one layer an octave.
pub(super) fn upload_tile(device: &RenderDevice, queue: &RenderQueue) -> TextureView {
    let extent = Extent3d { width: TILE as u32, height: TILE as u32, depth_or_array_layers: OCTAVES as u32 };
    let descriptor = TextureDescriptor {
        label: Some("mirrorball_grain_noise"),
        size: extent,
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format: TextureFormat::Rgba8Snorm,
        usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let texture = device.create_texture_with_data(queue, &descriptor, TextureDataOrder::LayerMajor, &texels());
    let dimension = Some(TextureViewDimension::D2Array);
    texture.create_view(&TextureViewDescriptor { dimension, ..default() })
}
