//! Filtered environments: the textures that light a scene.

use super::{
    refresh::{Progress, Refresh},
    source::SourceShape,
    specular_lobe::SpecularLobe,
};
use crate::environment_map::cube_image;
use bevy::{prelude::*, render::render_resource::TextureUsages};

/// Edge length of the diffuse map. Interpolation over 2.8° gets the kink that a lamp makes at the horizon wrong by
/// 0.2 %.
const DIFFUSE_EDGE: u32 = 32;
/// Maximum edge length of the specular map's sharpest level.
const MAX_SPECULAR_EDGE: u32 = 256;
/// Edge length of the specular map's last level, which holds perceptual roughness 1.
pub(super) const ROUGHEST_EDGE: u32 = 4;

/// Diffuse and specular map of a [`LiveEnvironment`](super::LiveEnvironment), on the same entity: cubes of 16-bit
/// floats in the units of the source.
///
/// The GPU writes the maps, so do not change their [`Image`] assets. Environments with the same source,
/// [`Refresh`] and [`SpecularLobe`] share their maps.
///
/// ```
/// # use bevy::prelude::*;
/// # use bevy_mirrorball::prefilter::FilteredEnvironment;
/// fn share(environments: Query<&FilteredEnvironment>) -> Option<Handle<Image>> {
///     environments.iter().next().map(|maps| maps.specular.clone())
/// }
/// ```
#[derive(Component, Reflect, Clone, Debug)]
#[reflect(from_reflect = false, Component, Debug, Clone)]
pub struct FilteredEnvironment {
    /// Irradiance ÷ π by surface normal, one level.
    pub diffuse: Handle<Image>,
    /// Radiance by mirror direction; level m of n holds perceptual roughness m / (n − 1).
    pub specular: Handle<Image>,
    pub(super) source: Handle<Image>,
    #[reflect(ignore)]
    pub(super) shape: SourceShape,
    pub(super) refresh: Refresh,
    pub(super) lobe: SpecularLobe,
    /// Source resampled into a cube with a power of two as edge length, if it is not one itself.
    pub(super) resampled: Option<Handle<Image>>,
    /// Diffuse and specular map that are being made, if that takes several frames.
    pub(super) draft: Option<[Handle<Image>; 2]>,
    /// Viewpoint, if it differs from the point of capture; see [`DeskParallax`](super::DeskParallax).
    pub(super) viewpoint: Option<Vec4>,
    #[reflect(ignore)]
    pub(super) progress: Progress,
}

impl FilteredEnvironment {
    pub(super) fn allocate(
        images: &mut Assets<Image>,
        source: Handle<Image>,
        shape: SourceShape,
        (refresh, lobe): (Refresh, SpecularLobe),
        viewpoint: Option<Vec4>,
    ) -> Self {
        let cube_edge = shape.cube_edge();
        let specular_edge = cube_edge.clamp(ROUGHEST_EDGE, MAX_SPECULAR_EDGE);
        let levels = |edge: u32| (edge / ROUGHEST_EDGE).ilog2() + 1;
        let mut cube = |label, edge, levels| {
            let mut image = cube_image(label, edge, levels);
            image.texture_descriptor.usage |= TextureUsages::COPY_DST;
            images.add(image)
        };
        let mut result =
            |diffuse, specular| [cube(diffuse, DIFFUSE_EDGE, 1), cube(specular, specular_edge, levels(specular_edge))];
        let [diffuse, specular] = result("mirrorball_environment_diffuse", "mirrorball_environment_glossy");
        let draft = matches!(refresh, Refresh::Budget { .. })
            .then(|| result("mirrorball_environment_diffuse_draft", "mirrorball_environment_glossy_draft"));
        let resampled =
            (!shape.is_ready() || viewpoint.is_some()).then(|| cube("mirrorball_environment_resampled", cube_edge, 1));
        let progress = Progress::default();
        progress.request();
        Self { diffuse, specular, source, shape, refresh, lobe, resampled, draft, viewpoint, progress }
    }

    /// Level of the specular map that holds perceptual roughness 1.
    pub fn roughest_level(&self) -> u32 {
        (self.shape.cube_edge().clamp(ROUGHEST_EDGE, MAX_SPECULAR_EDGE) / ROUGHEST_EDGE).ilog2()
    }

    /// Requests that the maps are made again in the next frame, whatever the [`Refresh`] policy.
    pub fn request_refresh(&self) {
        self.progress.request();
    }
}
