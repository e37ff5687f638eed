//! Full sums over blocks: the diffuse map and the rough levels of the specular map.

use super::{
    blocks::{BLOCK_BUFFER_BYTES, BLOCK_EDGE, block_angles},
    cube_views::{bound, level_view},
    dispatch::{Dispatch, DispatchBuilder, face_quads, quad_groups, texel_groups},
    downsample::Pyramid,
    specular_lobe::SpecularLobe,
};
use bevy::render::render_resource::{Buffer, BufferDescriptor, BufferUsages, Texture};

/// Maximum edge length of the cube that the blocks are gathered from.
const MAX_GATHER_EDGE: u32 = 64;

/// Buffer of the blocks of one environment.
pub(super) struct BlockSums(Buffer);

impl BlockSums {
    pub(super) fn new(builder: &DispatchBuilder) -> Self {
        Self(builder.device.create_buffer(&BufferDescriptor {
            label: Some("mirrorball_environment_blocks"),
            size: u64::from(BLOCK_BUFFER_BYTES),
            usage: BufferUsages::STORAGE | BufferUsages::UNIFORM,
            mapped_at_creation: false,
        }))
    }

    /// Dispatch that fills the blocks from a cube or its pyramid.
    pub(super) fn gather(&self, builder: &DispatchBuilder, cube: &Texture, pyramid: &Pyramid) -> Option<Dispatch> {
        let input = pyramid.view_at_most(cube, MAX_GATHER_EDGE);
        let angles = builder.uniform("mirrorball_environment_block_angles", block_angles())?;
        let bindings = [(0, bound(&input)), (1, angles.as_entire_binding()), (2, self.0.as_entire_binding())];
        Some(builder.dispatch(&builder.pipelines.gather_blocks, &bindings, texel_groups(BLOCK_EDGE)))
    }

    /// Dispatch that makes the diffuse map.
    pub(super) fn diffuse(&self, builder: &DispatchBuilder, diffuse: &Texture) -> Dispatch {
        let output = level_view(diffuse, 0);
        let bindings = [(3, self.0.as_entire_binding()), (4, bound(&output))];
        let groups = quad_groups(face_quads(diffuse.width())).with_z(3);
        builder.dispatch(&builder.pipelines.diffuse, &bindings, groups)
    }

    /// Dispatch that makes a rough level of the specular map.
    pub(super) fn specular(
        &self,
        builder: &DispatchBuilder,
        lobe: SpecularLobe,
        specular: &Texture,
        level: u32,
        alpha: f64,
    ) -> Option<Dispatch> {
        let output = level_view(specular, level);
        let alpha = builder.uniform("mirrorball_environment_alpha", alpha as f32)?;
        let bindings = [(3, self.0.as_entire_binding()), (4, bound(&output)), (5, alpha.as_entire_binding())];
        let quads = 6 * face_quads(specular.width() >> level);
        let step = match lobe {
            SpecularLobe::Ggx => &builder.pipelines.specular_sum,
            SpecularLobe::Cosine => &builder.pipelines.cosine_sum,
        };
        Some(builder.dispatch(step, &bindings, quad_groups(quads)))
    }
}
