//! Copies of the dome and of the source of its light, from the main world.

use crate::{
    environment_map::EnvironmentCube,
    shadows::{
        bounce::Surfels,
        fitted_dome::{FittedDome, Refreshing},
        visibility_camera::VisibilityCamera,
    },
};
use bevy::{light::EnvironmentMapLight, prelude::*, render::Extract};
use std::collections::BTreeSet;

/// The dome in this frame.
#[derive(Resource, Default)]
pub(super) struct ExtractedDome {
    pub(super) fitted: FittedDome,
    pub(super) source: Option<DomeSource>,
    pub(super) surfels: Surfels,
    /// Directions whose shadow maps are still to be drawn, in ascending order.
    pub(super) pending: BTreeSet<u32>,
}

/// The environment cube that lights and colors the dome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DomeSource {
    pub(super) cube: AssetId<Image>,
    pub(super) cube_from_world: Quat,
    /// Whether a probe measures the cube, whose writes are then announced in
    /// [`CubeWrites`](crate::environment_map::CubeWrites).
    pub(super) is_measured: bool,
}

type ViewEnvironment = (&'static EnvironmentMapLight, Has<VisibilityCamera>);

pub(super) fn extract_dome(
    mut extracted: ResMut<ExtractedDome>,
    fitted: Extract<Res<FittedDome>>,
    surfels: Extract<Res<Surfels>>,
    refreshing: Extract<Res<Refreshing>>,
    cubes: Extract<Query<&EnvironmentCube>>,
    maps: Extract<Query<ViewEnvironment, With<Camera3d>>>,
) {
    if fitted.is_changed() {
        extracted.fitted.clone_from(&fitted);
    }
    if surfels.is_changed() {
        extracted.surfels.clone_from(&surfels);
    }
    extracted.pending.extend(&refreshing.chosen);
    let measured = cubes.iter().next().map(|cube| DomeSource {
        cube: cube.0.id(),
        cube_from_world: Quat::IDENTITY,
        is_measured: true,
    });
    extracted.source = measured.or_else(|| {
        let (map, _) = maps.iter().max_by_key(|(_, has_visibility)| *has_visibility)?;
        Some(DomeSource { cube: map.specular_map.id(), cube_from_world: map.rotation.inverse(), is_measured: false })
    });
}
