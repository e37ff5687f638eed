//! Environments filtered on the GPU for the engine.

mod exactness;
mod refresh;
mod sources;

use crate::{
    cubes,
    device::unrestricted,
    gpu,
    radiance_cube::{cube_image, texel, texels},
};
use bevy::{
    core_pipeline::tonemapping::{DebandDither, Tonemapping},
    math::DVec3,
    prelude::*,
};
use bevy_mirrorball::{
    environment_map::CubePixels,
    headless,
    prefilter::{EnvironmentState, FilteredEnvironment, LiveEnvironment, PrefilterPlugin},
};

/// Half floats have 11 significant bits; sums of thousands of them in single precision stay within a few such steps.
const FURNACE_TOLERANCE: f64 = 1e-3;

/// Deadline for shaders and filters.
const MAX_WAIT: std::time::Duration = std::time::Duration::from_secs(120);

/// A cube of a radiance by direction.
fn cube(edge: usize, radiance: impl Fn(DVec3) -> DVec3) -> Image {
    cube_image(edge, &texels(edge, radiance))
}

/// An app with one plain camera under an environment, and the picture it renders into.
fn lit_app(source: Image) -> Option<(App, Entity, Handle<Image>)> {
    // Bevy's own filter, with which some tests compare, needs more than WebGPU's limits.
    let mut app = gpu::app_with(headless::default_plugins().set(unrestricted()), |app| {
        app.add_plugins(PrefilterPlugin);
    })?;
    let source = app.world_mut().resource_mut::<Assets<Image>>().add(source);
    let (picture, target) = headless::add_target(&mut app, UVec2::new(96, 64));
    let camera = (
        Camera3d::default(),
        Transform::from_xyz(0.0, 0.0, 2.0),
        Tonemapping::None,
        DebandDither::Disabled,
        AmbientLight { brightness: 0.0, ..default() },
        LiveEnvironment::new(source),
        target,
    );
    let camera = app.world_mut().spawn(camera).id();
    // Shaders are loaded in the background, which takes its time on a busy machine.
    headless::update_until(&mut app, "filtering the environment", MAX_WAIT, |app| {
        let state = app.world().get::<EnvironmentState>(camera);
        !matches!(state, Some(EnvironmentState::Live { refreshes: 0, .. } | EnvironmentState::Waiting))
    })
    .expect("it is filtered or refused");
    Some((app, camera, picture))
}

fn maps_source(app: &App, camera: Entity) -> Handle<Image> {
    app.world().get::<LiveEnvironment>(camera).expect("it has one").source.clone()
}

fn diffuse_and_glossy(app: &mut App, camera: Entity) -> (CubePixels, CubePixels) {
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("the cube is accepted").clone();
    (cubes::read(app, &maps.diffuse), cubes::read(app, &maps.specular))
}

/// Largest relative difference between a cube and a function of direction, over all texels and channels.
fn worst_error(cube: &CubePixels, expected: impl Fn(DVec3) -> DVec3) -> f64 {
    let errors = cube.texels.iter().enumerate().map(|(i, got)| {
        let expected = expected(texel(cube.edge as usize, i).0);
        ((got.as_dvec3() - expected) / expected).abs().max_element()
    });
    errors.fold(0.0, f64::max)
}

/// A light that the maps hold, by its color: the GPU's answer to what was last uploaded.
fn shown(app: &mut App, camera: Entity) -> f32 {
    let maps = app.world().get::<FilteredEnvironment>(camera).expect("is lit").clone();
    cubes::read(app, &maps.diffuse).texels[0].x
}
