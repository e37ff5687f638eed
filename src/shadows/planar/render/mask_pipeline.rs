//! Pipelines that draw casters, projected onto a receiver, into a mask.

use crate::shadows::render::depth_pipeline::{DepthPipeline, DepthPipelineKey};
use bevy::{
    asset::load_embedded_asset,
    mesh::MeshVertexBufferLayoutRef,
    prelude::*,
    render::render_resource::{
        BlendComponent, BlendFactor, BlendOperation, BlendState, ColorTargetState, ColorWrites, CompareFunction,
        DepthStencilState, RenderPipelineDescriptor, SpecializedMeshPipeline, SpecializedMeshPipelineError,
        StencilFaceState, StencilOperation, StencilState, TextureFormat,
    },
};

/// Fraction of a light that is hidden, per color. Sums of many points need more than eight bits.
pub(super) const MASK_FORMAT: TextureFormat = TextureFormat::Rgba16Float;

/// Numbers of the points of a light, from 1.
pub(super) const STENCIL_FORMAT: TextureFormat = TextureFormat::Stencil8;

/// The pipelines of the shadow maps with another shader and another target.
#[derive(Resource)]
pub(super) struct MaskPipeline {
    depth: DepthPipeline,
    shader: Handle<Shader>,
}

pub(super) fn init_mask_pipeline(mut commands: Commands, assets: Res<AssetServer>, depth: Res<DepthPipeline>) {
    let shader = load_embedded_asset!(assets.as_ref(), "planar_mask_pass.wgsl");
    commands.insert_resource(MaskPipeline { depth: depth.clone(), shader });
}

impl SpecializedMeshPipeline for MaskPipeline {
    type Key = DepthPipelineKey;

    fn specialize(
        &self,
        key: DepthPipelineKey,
        layout: &MeshVertexBufferLayoutRef,
    ) -> Result<RenderPipelineDescriptor, SpecializedMeshPipelineError> {
        let mut descriptor = self.depth.specialize(key, layout)?;
        descriptor.label = Some("mirrorball_shadows_planar_mask".into());
        descriptor.vertex.shader = self.shader.clone();
        // Each point of a light has a number, which is kept where something is hidden from it: nothing is hidden twice,
        // whatever overlaps.
        let face = StencilFaceState {
            compare: CompareFunction::NotEqual,
            pass_op: StencilOperation::Replace,
            ..StencilFaceState::IGNORE
        };
        descriptor.depth_stencil = Some(DepthStencilState {
            format: STENCIL_FORMAT,
            depth_write_enabled: None,
            depth_compare: None,
            stencil: StencilState { front: face, back: face, read_mask: 0xff, write_mask: 0xff },
            bias: default(),
        });
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader = self.shader.clone();
            let add = BlendComponent {
                src_factor: BlendFactor::One,
                dst_factor: BlendFactor::One,
                operation: BlendOperation::Add,
            };
            fragment.targets = vec![Some(ColorTargetState {
                format: MASK_FORMAT,
                blend: Some(BlendState { color: add, alpha: add }),
                write_mask: ColorWrites::ALL,
            })];
        }
        Ok(descriptor)
    }
}
