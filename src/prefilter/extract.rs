//! Filtered environments, copied from the main world to the render world.

use super::filtered_environment::FilteredEnvironment;
use bevy::{prelude::*, render::Extract};

/// All environments of this frame.
#[derive(Resource, Default)]
pub(super) struct ExtractedEnvironments(pub(super) Vec<FilteredEnvironment>);

pub(super) fn extract_environments(
    mut extracted: ResMut<ExtractedEnvironments>,
    environments: Extract<Query<&FilteredEnvironment>>,
) {
    extracted.0.clear();
    extracted.0.extend(environments.iter().cloned());
}
