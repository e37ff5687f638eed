//! Extraction of map views into the render world.

use super::{MapView, ShownMap, map_view_pipeline::ShownUniform};
use crate::{camera::ArCamera, environment_map::EnvironmentCube, prefilter::FilteredEnvironment};
use bevy::{prelude::*, render::Extract};

pub(super) struct ExtractedView {
    pub(super) map: AssetId<Image>,
    pub(super) image: AssetId<Image>,
    pub(super) shown: ShownUniform,
}

#[derive(Resource, Default)]
pub(super) struct ExtractedViews(pub(super) Vec<ExtractedView>);

type Lit = (&'static FilteredEnvironment, Has<ArCamera>);

pub(super) fn extract_views(
    mut extracted: ResMut<ExtractedViews>,
    views: Extract<Query<&MapView>>,
    measured: Extract<Query<&EnvironmentCube>>,
    lit: Extract<Query<Lit>>,
) {
    extracted.0.clear();
    let filtered = lit.iter().max_by_key(|(_, is_ar)| *is_ar).map(|(filtered, _)| filtered);
    extracted.0.extend(views.iter().filter_map(|view| {
        let (map, level) = match view.map {
            ShownMap::Measured | ShownMap::Confidence => (&measured.iter().next()?.0, 0),
            ShownMap::Diffuse => (&filtered?.diffuse, 0),
            ShownMap::Specular(level) => (&filtered?.specular, level),
        };
        let alpha = if view.map == ShownMap::Confidence { 1.0 } else { 0.0 };
        Some(ExtractedView { map: map.id(), image: view.image.id(), shown: ShownUniform { level, alpha } })
    }));
}
