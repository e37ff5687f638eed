//! A game that tracks a desk and measures its light.

use crate::truth::phantom_meshes;
use bevy::{asset::RenderAssetUsages, mesh::PrimitiveTopology, prelude::*};
use bevy_mirrorball::{
    camera::CameraPlugin, lighting::LightingPlugin, phantom::PhantomPlugin, prelude::*, probe::ProbePlugin,
    tracking::TrackingPlugin,
};
use std::path::Path;

/// A game that sees a desk: the entity of its ball.
pub(crate) fn desk_app(
    camera: (ArCamera, CameraFeed),
    probe: (LightProbeSphere, Transform),
    phantoms: &Path,
) -> (App, Entity) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), TransformPlugin, CameraPlugin, TrackingPlugin))
        .init_asset::<bevy::shader::Shader>()
        .init_asset::<Mesh>()
        .init_asset::<Image>()
        .add_plugins((PhantomPlugin, ProbePlugin, LightingPlugin));
    app.world_mut().spawn(camera);
    app.world_mut().spawn((MarkerAnchor::new(0, 0.1), WorldOrigin, Transform::from_xyz(0.0, 0.0006, 0.0)));
    let probe = app.world_mut().spawn(probe).id();
    for phantom in phantom_meshes(phantoms) {
        let positions: Vec<Vec3> = phantom.triangles.into_iter().flatten().collect();
        let mesh = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        let role = PhantomObject { casts: phantom.casts, receives: phantom.receives, ..default() };
        app.world_mut().spawn((Mesh3d(mesh), role));
    }
    (app, probe)
}
