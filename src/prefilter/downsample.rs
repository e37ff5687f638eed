//! Pyramid of padded faces: the environment cube at half its resolution and less.

use super::{
    cube_views::{bound, level_view, padded_faces},
    dispatch::{Dispatch, DispatchBuilder, padded_groups, texel_groups},
    filtered_environment::ROUGHEST_EDGE,
};
use bevy::render::{
    render_resource::{Texture, TextureView},
    renderer::RenderDevice,
};

/// Levels of the pyramid, each half as wide as the one before. They are padded, because lookups interpolate, also
/// across edges.
pub(super) struct Pyramid(Vec<Texture>);

impl Pyramid {
    /// Textures for a cube with this edge length; the first level is half as wide.
    pub(super) fn allocate(device: &RenderDevice, cube_edge: u32) -> Self {
        let finest = (cube_edge / 2).max(ROUGHEST_EDGE);
        let edges = (0..=(finest / ROUGHEST_EDGE).ilog2()).map(|level| finest >> level);
        Self(edges.map(|edge| padded_faces(device, "mirrorball_environment_pyramid", edge)).collect())
    }

    /// Index of the coarsest level.
    pub(super) fn last(&self) -> usize {
        self.0.len() - 1
    }

    /// View of a level; beyond the last one, of the last one.
    pub(super) fn view(&self, level: usize) -> TextureView {
        level_view(&self.0[level.min(self.last())], 0)
    }

    /// View of the cube or of the level of its pyramid with at most this edge length.
    pub(super) fn view_at_most(&self, cube: &Texture, max_edge: u32) -> TextureView {
        match (cube.width() / max_edge).max(1).ilog2() {
            0 => level_view(cube, 0),
            level => level_view(&self.0[level as usize - 1], 0),
        }
    }

    /// Appends the dispatches that fill the levels, and the specular map's sharpest level if it is as large as the
    /// cube.
    pub(super) fn push_dispatches(
        &self,
        builder: &DispatchBuilder,
        cube: &Texture,
        specular: &Texture,
        dispatches: &mut Vec<Dispatch>,
    ) {
        for (level, coarser) in self.0.iter().enumerate() {
            let groups = padded_groups(coarser);
            let output = level_view(coarser, 0);
            dispatches.push(match level.checked_sub(1) {
                None if specular.width() == cube.width() => {
                    let (finer, copy) = (level_view(cube, 0), level_view(specular, 0));
                    let bindings = [(0, bound(&finer)), (1, bound(&output)), (3, bound(&copy))];
                    builder.dispatch(&builder.pipelines.halve_and_copy, &bindings, groups)
                }
                None => {
                    let finer = level_view(cube, 0);
                    builder.dispatch(&builder.pipelines.halve, &[(0, bound(&finer)), (1, bound(&output))], groups)
                }
                Some(above) => {
                    let finer = level_view(&self.0[above], 0);
                    let bindings = [(0, bound(&finer)), (1, bound(&output)), (2, builder.sampler())];
                    builder.dispatch(&builder.pipelines.smooth_halve, &bindings, groups)
                }
            });
        }
    }

    /// Dispatch that copies the pyramid's level of the same size into the sharpest level of the specular map.
    pub(super) fn copy_sharpest(&self, builder: &DispatchBuilder, cube: &Texture, specular: &Texture) -> Dispatch {
        let edge = specular.width();
        let (input, output) = (self.view_at_most(cube, edge), level_view(specular, 0));
        let bindings = [(0, bound(&input)), (3, bound(&output))];
        builder.dispatch(&builder.pipelines.sharpest, &bindings, texel_groups(edge))
    }
}
