//! Resampling of other sources into a cube with a power of two as edge length.

use super::{
    cube_views::{bound, level_view, single_level},
    dispatch::{Dispatch, DispatchBuilder, texel_groups},
    source::SourceShape,
};
use bevy::render::{
    render_resource::{Buffer, Texture, TextureViewDimension},
    texture::GpuImage,
};

/// Dispatch that resamples `source` into `cube`, seen from a viewpoint (see `DeskParallax::viewpoint`).
pub(super) fn resample(
    builder: &DispatchBuilder,
    shape: SourceShape,
    source: &GpuImage,
    cube: &Texture,
    viewpoint: &Buffer,
) -> Dispatch {
    let (binding, dimension, step) = match shape {
        SourceShape::Equirect(_) => (2, TextureViewDimension::D2, &builder.pipelines.resample_equirect),
        SourceShape::Cube(_) => (3, TextureViewDimension::D2Array, &builder.pipelines.resample_cube),
    };
    let (image, output) = (single_level(&source.texture, 0, dimension), level_view(cube, 0));
    let bindings = [(0, bound(&output)), (1, viewpoint.as_entire_binding()), (binding, bound(&image))];
    builder.dispatch(step, &bindings, texel_groups(cube.width()))
}
