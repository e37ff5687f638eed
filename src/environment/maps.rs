//! The textures a filtered environment consists of.

use crate::probe::cube_image;
use bevy::prelude::*;

/// Edge length of the irradiance map: interpolated over 5.6°, the cosine lobe is off by 0.1 %.
const DIFFUSE_EDGE: u32 = 16;
/// Largest edge length of the glossy map's sharpest level.
const MAX_GLOSSY_EDGE: u32 = 256;
/// Edge length of the glossy map's last level, which holds perceptual roughness 1.
const ROUGHEST_EDGE: u32 = 4;

/// The maps made from a [`LiveEnvironment`](super::LiveEnvironment), on the same entity: cubes of 16-bit floats in its units.
///
/// Written by the GPU: do not change the [`Image`] assets behind them.
#[derive(Component, Clone, Debug)]
pub struct FilteredEnvironment {
    /// Irradiance ÷ π by surface normal, one level.
    pub diffuse: Handle<Image>,
    /// Radiance by mirror direction; level m of n holds perceptual roughness m / (n − 1).
    pub glossy: Handle<Image>,
    /// The source in half its resolution and less; in between.
    pub(super) pyramid: Handle<Image>,
    pub(super) source: Handle<Image>,
}

impl FilteredEnvironment {
    pub(super) fn allocate(images: &mut Assets<Image>, source: Handle<Image>, source_edge: u32) -> Self {
        let glossy_edge = source_edge.clamp(ROUGHEST_EDGE, MAX_GLOSSY_EDGE);
        let glossy_levels = (glossy_edge / ROUGHEST_EDGE).ilog2() + 1;
        let pyramid_edge = (source_edge / 2).max(ROUGHEST_EDGE);
        let pyramid_levels = (pyramid_edge / ROUGHEST_EDGE).ilog2() + 1;
        Self {
            diffuse: images.add(cube_image("mirrorball_environment_diffuse", DIFFUSE_EDGE, 1)),
            glossy: images.add(cube_image("mirrorball_environment_glossy", glossy_edge, glossy_levels)),
            pyramid: images.add(cube_image("mirrorball_environment_pyramid", pyramid_edge, pyramid_levels)),
            source,
        }
    }
}
